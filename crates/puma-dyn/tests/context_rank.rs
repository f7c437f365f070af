//! Sec. 4.3.2: how many dimensions the torques of many loads span, joint by joint.
//!
//! Torques are linear in the constant 1 and the ten inertial parameters of what the last link
//! carries (eqs. (10)–(12)), so the matrix of states × contexts of joint i has the rank of A_iΠ, with
//! A_i keeping what the states make visible at joint i (eq. (13)).

use puma_dyn::nalgebra::DMatrix;
use puma_dyn::{Context, Payload, Scenario, Workspace, rnea};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const N_JOINTS: usize = 6;

/// q, q̇ and q̈ of one moment.
type State = [[f64; N_JOINTS]; 3];

/// Fewest orders of magnitude between the singular values that count and those that do not.
const GAP: f64 = 1e4;

/// A singular value below this part of the largest is rounding: n ε with n ≈ 10³, and as much again.
const ROUNDING: f64 = 1e-12;

/// Torques of one joint, one row per state and one column per context.
fn torques(scenario: &Scenario, states: &[State], contexts: &[Context]) -> Vec<DMatrix<f64>> {
    let mut workspace = Workspace::new(scenario.model());
    let mut matrices = vec![DMatrix::zeros(states.len(), contexts.len()); N_JOINTS];
    for (row, [q, qd, qdd]) in states.iter().enumerate() {
        for (col, context) in contexts.iter().enumerate() {
            let mut tau = [0.0; N_JOINTS];
            let (model, effects) = (scenario.model(), scenario.effects());
            rnea(
                model,
                &mut workspace,
                effects,
                context,
                q,
                qd,
                qdd,
                &mut tau,
            );
            for (matrix, tau) in matrices.iter_mut().zip(tau) {
                matrix[(row, col)] = tau;
            }
        }
    }
    matrices
}

/// Numerical rank, with a gap below the singular values that it counts.
fn rank(matrix: &DMatrix<f64>) -> usize {
    let values = matrix.singular_values();
    let rank = values.iter().filter(|v| **v > ROUNDING * values[0]).count();
    let next = values.get(rank).copied().unwrap_or(0.0);
    assert!(
        values[rank - 1] >= GAP * next,
        "no gap: {:.1e}",
        values.transpose() / values[0]
    );
    rank
}

fn ranks(scenario: &Scenario, states: &[State], contexts: &[Context]) -> Vec<usize> {
    let matrices = torques(scenario, states, contexts);
    matrices.iter().map(rank).collect()
}

/// States along all trajectories, on which the tool keeps its orientation.
fn along_the_paths(scenario: &Scenario) -> Vec<State> {
    let trajectories = scenario.trajectories().expect("reachable paths");
    let of = |slice: &[f64]| std::array::from_fn(|joint| slice[joint]);
    (trajectories.iter())
        .flat_map(|trajectory| {
            (0..trajectory.n_samples()).step_by(53).map(move |sample| {
                let (q, qd, qdd) = trajectory.state(sample);
                [of(q), of(qd), of(qdd)]
            })
        })
        .collect()
}

/// States in which every joint turns: so does the tool.
fn turning_the_tool() -> Vec<State> {
    let mut rng = ChaCha8Rng::seed_from_u64(432);
    let mut any = |size: f64| std::array::from_fn(|_| rng.random_range(-size..size));
    (0..1000).map(|_| [any(3.0), any(2.0), any(5.0)]).collect()
}

/// The scenario's loads.
fn loads(scenario: &Scenario) -> Vec<Context> {
    let payloads = (0..scenario.load_names().len()).map(|idx| scenario.payload(idx));
    payloads.map(|payload| carried(scenario, payload)).collect()
}

fn carried(scenario: &Scenario, payload: &Payload) -> Context {
    let model = scenario.model();
    let attached = model.attach(model.frames().len() - 1, payload);
    attached.expect("the last link moves").into()
}

#[test]
fn fixed_tool_shows_at_most_mass_and_first_moment_of_the_load() {
    // A tool that does not turn needs the force m (a − g) at the load's centre and no moment, so at
    // most 1, m and m c show: five dimensions. The axes of joints 4 to 6 meet in the wrist centre,
    // where the mass has no lever arm: 1 and m c, four. The axis of joint 6 is fixed in the tool: m c
    // along it has no lever arm either, three. Joint 1 turns about the vertical: gravity and m c_z do
    // not show, four.
    let scenario = Scenario::reference();
    let (states, contexts) = (along_the_paths(&scenario), loads(&scenario));
    assert_eq!(ranks(&scenario, &states, &contexts), [4, 5, 5, 4, 4, 3]);
    // Without c15, as in sec. 4.6.
    let trained = &contexts[..14];
    assert_eq!(ranks(&scenario, &states, trained), [4, 5, 5, 4, 4, 3]);
}

#[test]
fn path_in_a_vertical_plane_shows_one_number_of_the_load_to_joint_1() {
    // Along p2 the horizontal acceleration has one direction d and size u: (r × a)·z = u (r₀ × d)·z,
    // which is one number of m and m c times u. Over four planes there are three such numbers, the
    // third of them small because the planes turn almost in proportion to their distance.
    let scenario = Scenario::reference();
    let (states, contexts) = (along_the_paths(&scenario), loads(&scenario));
    let per_path = states.len() / scenario.path_names().len();
    let p2 = &states[per_path..2 * per_path];
    assert_eq!(ranks(&scenario, p2, &contexts), [2, 5, 5, 4, 4, 3]);

    let torques = torques(&scenario, &states, &contexts);
    let values = torques[0].singular_values();
    assert!(values[3] < 1e-5 * values[0], "{values}");
}

#[test]
fn turning_tool_shows_all_ten_parameters_to_the_first_three_joints() {
    // Joints 4 and 5 miss the mass, which has no lever arm about the wrist: ten. Joint 6 misses the
    // first moment along its axis too, and I_xx and I_yy show only in their difference: eight.
    let scenario = Scenario::reference();
    let (states, contexts) = (turning_the_tool(), loads(&scenario));
    assert_eq!(
        ranks(&scenario, &states, &contexts),
        [11, 11, 11, 10, 10, 8]
    );
}
