//! Coulomb friction against closed forms: a block that slides, stops, is held, turns back and hits a wall.

use puma_dyn::motion::{ArmSimulator, CompliantWall, SlipMode, Work};
use puma_dyn::robot::{Drive, Inertial, JointDescription, JointKind, LinkDescription};
use puma_dyn::{Context, DynError, Effects, Friction, Model, RobotDescription};

const MASS: f64 = 2.0;
/// Coulomb friction of forward and of backward motion, N.
const FORWARD: f64 = 3.0;
const BACKWARD: f64 = 5.0;

/// A block on a rail along x, weightless, with Coulomb friction and viscous friction `damping`.
fn block(damping: f64) -> Model {
    let mut robot = RobotDescription::new("block");
    robot.links.push(LinkDescription::new("rail", None));
    let inertial = Inertial {
        mass: MASS,
        centre: [0.0; 3],
        inertia: [[0.0; 3]; 3],
    };
    robot
        .links
        .push(LinkDescription::new("block", Some(inertial)));
    robot.joints.push(JointDescription {
        axis: [1.0, 0.0, 0.0],
        drive: Drive {
            coulomb_motor_positive: FORWARD,
            coulomb_motor_negative: -BACKWARD,
            viscous_joint: damping,
            ..Drive::NONE
        },
        ..JointDescription::new("slide", JointKind::Prismatic, "rail", "block")
    });
    Model::new(&robot).expect("valid in this test")
}

fn moving(model: &Model, speed: f64) -> ArmSimulator<'_> {
    ArmSimulator::new(model, Effects::ALL, Context::empty(), &[0.0], &[speed])
        .expect("valid in this test")
}

fn close(found: f64, expected: f64, tolerance: f64) {
    let error = (found - expected).abs();
    assert!(
        error <= tolerance,
        "{found} {expected}: {error:e} > {tolerance:e}"
    );
}

/// Rounding of some hundred steps with numbers up to ten.
const ROUNDING: f64 = 1e4 * f64::EPSILON;

#[test]
fn a_block_stops_where_and_when_friction_has_used_its_energy_up() {
    // t = m v / F, x = m v² / 2F; steps of 0.07 s do not meet t.
    let model = block(0.0);
    for (speed, friction) in [(1.7, FORWARD), (-1.7, BACKWARD)] {
        let mut arm = moving(&model, speed);
        let time = MASS * speed.abs() / friction;
        arm.advance(&[0.0], time - 1e-6, 10).unwrap();
        close(arm.qd()[0].abs(), 1e-6 * friction / MASS, ROUNDING);
        arm.advance(&[0.0], 0.07, 1).unwrap();
        let stopped = arm.q()[0];
        close(
            stopped.abs(),
            MASS * speed * speed / (2.0 * friction),
            ROUNDING,
        );
        close(arm.work().friction, 0.5 * MASS * speed * speed, ROUNDING);
        assert_eq!(arm.qd()[0].to_bits(), 0);

        // Any push below Coulomb's torque leaves it there, to the bit.
        for push in [0.0, 0.999 * FORWARD, -0.999 * BACKWARD, FORWARD] {
            arm.advance(&[push], 1.0, 100).unwrap();
            assert_eq!(arm.q()[0].to_bits(), stopped.to_bits());
            assert_eq!(arm.modes(), [SlipMode::Sticking]);
        }
        arm.advance(&[FORWARD + 0.5], 2.0, 10).unwrap();
        close(arm.q()[0] - stopped, 0.5 * (0.5 / MASS) * 4.0, ROUNDING);
    }
}

#[test]
fn with_viscous_friction_the_block_stops_in_the_logarithm_of_the_closed_form() {
    // m v̇ = −b v − F:  v = (v₀ + F/b) e^{−bt/m} − F/b,  stop at (m/b) ln(1 + b v₀ / F).
    let (damping, speed) = (1.5, 2.0);
    let model = block(damping);
    let stop = MASS / damping * (damping * speed / FORWARD).ln_1p();
    let distance = (MASS * speed - FORWARD * stop) / damping;
    let error_of = |step: f64| {
        let mut arm = moving(&model, speed);
        let mut time = 0.0;
        while arm.qd()[0] > 0.0 {
            arm.advance(&[0.0], step, 1).unwrap();
            time += step;
        }
        assert!(time >= stop && time - step <= stop, "{time} {stop}");
        (arm.q()[0] - distance).abs()
    };
    let (coarse, fine) = (error_of(0.2), error_of(0.1));
    assert!(
        coarse < 1e-4 && fine < coarse / 12.0,
        "order 4: {coarse:e} {fine:e}"
    );
}

#[test]
fn a_block_that_is_pushed_back_turns_at_once_and_slides_by_the_other_friction() {
    // v̇ = −(P + F⁺)/m until the turn, −(P − F⁻)/m after it: parabolas, exact for Runge–Kutta.
    let model = block(0.0);
    let (speed, push) = (1.0, 9.0);
    let mut arm = moving(&model, speed);
    arm.advance(&[-push], 0.5, 3).unwrap();
    let turn = MASS * speed / (push + FORWARD);
    let reach = 0.5 * speed * turn;
    let (left, back) = (0.5 - turn, (push - BACKWARD) / MASS);
    close(arm.qd()[0], -back * left, ROUNDING);
    close(arm.q()[0], reach - 0.5 * back * left * left, ROUNDING);
}

#[test]
fn without_dissipation_a_wall_returns_the_block_after_half_a_period() {
    // δ = v √(m/k) sin(√(k/m) t): deepest v √(m/k), back after π √(m/k).
    let model = block(0.0);
    let rigid = Effects {
        friction: Friction::None,
        rotor_inertia: false,
    };
    let (speed, stiffness) = (0.8, 5000.0);
    let wall = CompliantWall {
        frame_idx: 1,
        tip: [0.1, 0.0, 0.0],
        point: [0.1, 3.0, -1.0],
        normal: [-1.0, 0.0, 0.0],
        stiffness,
        dissipation: 0.0,
    };
    let arm = ArmSimulator::new(&model, rigid, Context::empty(), &[0.0], &[speed]).unwrap();
    let mut arm = arm.with_wall(wall.clone()).unwrap();
    let half_period = std::f64::consts::PI * (MASS / stiffness).sqrt();
    // RK4 on a sine of period 2π: relative error (ωh)⁴/120 a radian, with ωh = π/400.
    let tolerance = (std::f64::consts::PI / 400.0_f64).powi(4);
    arm.advance(&[0.0], 0.5 * half_period, 200).unwrap();
    close(
        arm.wall_force(),
        speed * (stiffness * MASS).sqrt(),
        100.0 * tolerance,
    );
    arm.advance(&[0.0], 0.5 * half_period, 200).unwrap();
    close(arm.qd()[0], -speed, tolerance);
    close(arm.q()[0], 0.0, tolerance);

    // At rest against it, a push P is P/k deep.
    let arm = ArmSimulator::new(&model, rigid, Context::empty(), &[40.0 / stiffness], &[0.0]);
    let mut arm = arm.unwrap().with_wall(wall).unwrap();
    arm.advance(&[40.0], 0.1, 100).unwrap();
    close(arm.q()[0], 40.0 / stiffness, ROUNDING);
    let Work { motors, wall, .. } = arm.work();
    close(motors + wall, 0.0, ROUNDING);
}

#[test]
fn what_cannot_be_simulated_is_refused_by_name() {
    let model = puma_dyn::puma560::model();
    let old = Effects {
        friction: Friction::Toolbox2008,
        rotor_inertia: true,
    };
    let refused = ArmSimulator::new(&model, old, Context::empty(), &[0.0; 6], &[0.0; 6]);
    let message = refused.unwrap_err().to_string();
    assert!(
        message.starts_with("joint `joint1`: its Coulomb friction"),
        "{message}"
    );

    let mut arm =
        ArmSimulator::new(&model, Effects::ALL, Context::empty(), &[0.0; 6], &[0.0; 6]).unwrap();
    let mut tau = [0.0; 6];
    tau[3] = f64::NAN;
    let message = arm.advance(&tau, 1e-3, 1).unwrap_err().to_string();
    assert_eq!(message, "joint `joint4`: torque is NaN");
    let error = arm.advance(&[1e300; 6], 1.0, 1).unwrap_err();
    assert!(matches!(error, DynError::Simulation { .. }), "{error}");
}
