//! The torques of a robot from a URDF file at one state, and what each of them is made of.
//!
//! ```text
//! cargo run -p puma-dyn --example urdf_torques [robot.urdf [sidecar.toml]]
//! ```
//! Without a file it is the PUMA 560, whose sidecar states gears, rotors and friction.

use std::path::{Path, PathBuf};

use puma_dyn::{
    Context, DynError, Effects, Friction, TorqueTerms, Workspace, load_urdf, torque_terms,
};

#[expect(clippy::print_stdout, reason = "the table is what it is for")]
fn main() -> Result<(), DynError> {
    let mut arguments = std::env::args_os().skip(1).map(PathBuf::from);
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures");
    let fixture = |name: &str| fixtures.join(name);
    let (urdf, sidecar) = match arguments.next() {
        Some(urdf) => (urdf, arguments.next()),
        None => (fixture("puma560.urdf"), Some(fixture("puma560.toml"))),
    };
    let robot = load_urdf(&urdf, sidecar.as_deref())?;
    for warning in &robot.warnings {
        println!("warning: {warning}");
    }

    // One number per moving joint: rad, rad/s and rad/s², or m, m/s and m/s² where it slides.
    let model = &robot.model;
    let n = model.n_joints();
    let (q, qd, qdd) = (vec![0.5; n], vec![1.0; n], vec![2.0; n]);
    let friction = robot.friction.unwrap_or(Friction::Modern);
    let effects = Effects {
        friction,
        ..Effects::ALL
    };

    let mut workspace = Workspace::new(model);
    let (bare, mut terms) = (Context::empty(), TorqueTerms::new(model));
    torque_terms(
        model,
        &mut workspace,
        effects,
        &bare,
        &q,
        &qd,
        &qdd,
        &mut terms,
    );

    let names = terms.named().map(|(name, _)| format!("{name:>10}"));
    println!("{:>20}{}{:>10}", "joint", names.concat(), "sum"); // N·m, N where it slides
    for (joint, name) in model.joint_names().iter().enumerate() {
        let part = |(_, term): (&str, &[f64])| format!("{:10.3}", term[joint]);
        let parts = terms.named().map(part);
        println!("{name:>20}{}{:10.3}", parts.concat(), terms.total(joint));
    }
    Ok(())
}
