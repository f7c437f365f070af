// Times Pinocchio's rnea on request: rnea URDF GRAVITY N_STATES
// Standard input: N_STATES rows of q, qd, qdd, then lines "torques" or "round PASSES".
#include <chrono>
#include <cstdio>
#include <iostream>
#include <string>
#include <vector>

#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/multibody/data.hpp>
#include <pinocchio/multibody/model.hpp>
#include <pinocchio/parsers/urdf.hpp>

struct State {
  Eigen::VectorXd q, qd, qdd;
};

// A continuous joint has two numbers (cosine, sine) in Pinocchio's q.
static Eigen::VectorXd configuration(const pinocchio::Model &model, const Eigen::VectorXd &angles) {
  Eigen::VectorXd q(model.nq);
  for (pinocchio::JointIndex j = 1; j < model.joints.size(); ++j) {
    const double angle = angles[model.joints[j].idx_v()];
    const int at = model.joints[j].idx_q();
    if (model.joints[j].nq() == 2) {
      q[at] = std::cos(angle);
      q[at + 1] = std::sin(angle);
    } else {
      q[at] = angle;
    }
  }
  return q;
}

int main(int argc, char **argv) {
  if (argc != 4) return 2;
  pinocchio::Model model;
  pinocchio::urdf::buildModel(argv[1], model);
  model.gravity.linear() << 0.0, 0.0, -std::stod(argv[2]);
  pinocchio::Data data(model);

  std::vector<State> states;
  const int count = std::stoi(argv[3]);
  for (int i = 0; i < count; ++i) {
    Eigen::VectorXd angles(model.nv);
    State s{Eigen::VectorXd(model.nq), Eigen::VectorXd(model.nv), Eigen::VectorXd(model.nv)};
    for (int j = 0; j < model.nv; ++j) std::cin >> angles[j];
    for (int j = 0; j < model.nv; ++j) std::cin >> s.qd[j];
    for (int j = 0; j < model.nv; ++j) std::cin >> s.qdd[j];
    s.q = configuration(model, angles);
    states.push_back(s);
  }

  std::string request;
  while (std::cin >> request) {
    if (request == "torques") {
      for (const State &s : states) {
        const Eigen::VectorXd &tau = pinocchio::rnea(model, data, s.q, s.qd, s.qdd);
        for (int j = 0; j < model.nv; ++j) std::printf("%.17g ", tau[j]);
        std::printf("\n");
      }
    } else {
      int passes;
      std::cin >> passes;
      double sink = 0.0;
      const auto start = std::chrono::steady_clock::now();
      for (int pass = 0; pass < passes; ++pass)
        for (const State &s : states) sink += pinocchio::rnea(model, data, s.q, s.qd, s.qdd)[0];
      const auto stop = std::chrono::steady_clock::now();
      volatile double keep = sink;
      (void)keep;
      const double ns = std::chrono::duration<double, std::nano>(stop - start).count();
      std::printf("%.6f\n", ns / (double(passes) * double(states.size())));
    }
    std::fflush(stdout);
  }
  return 0;
}
