//! puma-dyn: the rigid body alone, and with everything a real drive has to supply.

use std::hint::black_box;
use std::time::Instant;

use anyhow::{Context as _, Result};
use puma_dyn::{Context, Effects, Model, Payload, Scenario, Workspace, puma560, rnea};

use crate::states::State;
use crate::{Contestant, GRAVITY, States};

struct Ours<'a> {
    name: &'static str,
    model: Model,
    workspace: Workspace,
    effects: Effects,
    context: Context,
    states: &'a States,
}

pub fn contestants(states: &States) -> Result<Vec<Box<dyn Contestant + '_>>> {
    let model = puma560::model().with_gravity([0.0, 0.0, -GRAVITY]);
    let workspace = Workspace::new(&model);
    let rigid = Ours {
        name: "puma-dyn, rigid body",
        effects: Effects::RIGID_BODY,
        context: Context::empty(),
        model: model.clone(),
        workspace: workspace.clone(),
        states,
    };
    let name = "puma-dyn, with friction, rotors and payload";
    let context = loaded(&model)?;
    let full = Ours {
        name,
        effects: Effects::ALL,
        context,
        model,
        workspace,
        states,
    };
    Ok(vec![Box::new(rigid), Box::new(full)])
}

/// A 2 kg cuboid held askew.
fn loaded(model: &Model) -> Result<Context> {
    let payload = Payload::cuboid(2.0, [0.1, 0.2, 0.3], [0.02, 0.0, 0.1], [0.3, -0.2, 0.5])?;
    let flange = model
        .frame_idx(puma560::LAST_LINK)
        .context("no last link")?;
    Ok(model.attach(flange, &payload)?.into())
}

impl Ours<'_> {
    fn call(&mut self, state: &State, tau: &mut [f64; 6]) {
        let State { q, qd, qdd } = state;
        let (workspace, context) = (&mut self.workspace, &self.context);
        rnea(
            &self.model,
            workspace,
            self.effects,
            context,
            q,
            qd,
            qdd,
            tau,
        );
    }
}

impl Contestant for Ours<'_> {
    fn name(&self) -> &str {
        self.name
    }

    fn is_rigid_body(&self) -> bool {
        self.effects == Effects::RIGID_BODY
    }

    fn torques(&mut self) -> Result<Vec<[f64; 6]>> {
        let mut tau = [0.0; 6];
        let states = self.states;
        let call = |state| {
            self.call(state, &mut tau);
            tau
        };
        Ok(states.iter().map(call).collect())
    }

    fn round(&mut self, passes: usize) -> Result<f64> {
        let mut tau = [0.0; 6];
        let states = self.states;
        let start = Instant::now();
        for _ in 0..passes {
            for state in states {
                self.call(state, &mut tau);
                black_box(&tau);
            }
        }
        Ok(start.elapsed().as_secs_f64() * 1e9 / (passes * states.len()) as f64)
    }
}

/// Times the whole data set: every path at every speed under every load, friction and rotors included.
pub fn time_data_set() -> Result<()> {
    let scenario = Scenario::reference();
    let start = Instant::now();
    let trajectories = scenario.trajectories()?;
    let kinematics = start.elapsed().as_secs_f64();

    let start = Instant::now();
    let mut n_vectors = 0;
    for trajectory in &trajectories {
        for load_idx in 0..scenario.load_names().len() {
            n_vectors += black_box(scenario.torques(trajectory, load_idx)).len() / 6;
        }
    }
    let seconds = start.elapsed().as_secs_f64();
    println!("\n{n_vectors} torque vectors of the data set: {seconds:.3} s on one core");
    println!(
        "(their {} trajectories before that: {kinematics:.3} s)",
        trajectories.len()
    );
    Ok(())
}
