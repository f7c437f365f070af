// Times Pinocchio's rnea on request: rnea GRAVITY N_STATES
// Standard input: six rows, one per joint about z, with rotation (9, row after row) and translation
// (3) in the parent, mass, centre (3) and inertia about it (9); then N_STATES rows of q, qd, qdd;
// then lines "torques" or "round PASSES".
#include <chrono>
#include <cstdio>
#include <iostream>
#include <string>
#include <vector>

#include <pinocchio/algorithm/rnea.hpp>
#if __has_include(<pinocchio/multibody.hpp>) // from version 4
#include <pinocchio/multibody.hpp>
#else
#include <pinocchio/multibody/data.hpp>
#include <pinocchio/multibody/model.hpp>
#endif

constexpr int n_joints = 6;

struct State {
  Eigen::VectorXd q, qd, qdd;
};

template <typename Matrix> static Matrix read(int rows, int columns) {
  Matrix matrix(rows, columns);
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j) std::cin >> matrix(i, j);
  return matrix;
}

static pinocchio::Model read_model() {
  pinocchio::Model model;
  pinocchio::JointIndex parent = 0;
  for (int j = 0; j < n_joints; ++j) {
    const Eigen::Matrix3d rotation = read<Eigen::Matrix3d>(3, 3);
    const Eigen::Vector3d translation = read<Eigen::Vector3d>(3, 1);
    double mass;
    std::cin >> mass;
    const Eigen::Vector3d centre = read<Eigen::Vector3d>(3, 1);
    const Eigen::Matrix3d inertia = read<Eigen::Matrix3d>(3, 3);
    const pinocchio::SE3 placement(rotation, translation);
    const std::string name = "joint" + std::to_string(j + 1);
    parent = model.addJoint(parent, pinocchio::JointModelRZ(), placement, name);
    model.appendBodyToJoint(parent, pinocchio::Inertia(mass, centre, inertia));
  }
  return model;
}

int main(int argc, char **argv) {
  if (argc != 3) return 2;
  pinocchio::Model model = read_model();
  model.gravity.linear() << 0.0, 0.0, -std::stod(argv[1]);
  pinocchio::Data data(model);

  std::vector<State> states;
  for (int i = 0; i < std::stoi(argv[2]); ++i) {
    State s;
    s.q = read<Eigen::VectorXd>(n_joints, 1);
    s.qd = read<Eigen::VectorXd>(n_joints, 1);
    s.qdd = read<Eigen::VectorXd>(n_joints, 1);
    states.push_back(s);
  }

  std::string request;
  while (std::cin >> request) {
    if (request == "torques") {
      for (const State &s : states) {
        const Eigen::VectorXd &tau = pinocchio::rnea(model, data, s.q, s.qd, s.qdd);
        for (int j = 0; j < n_joints; ++j) std::printf("%.17g ", tau[j]);
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
