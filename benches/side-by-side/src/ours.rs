//! puma-dyn: the rigid body alone, and with everything a real drive has to supply.

use std::hint::black_box;
use std::time::Instant;

use anyhow::{Context as _, Result};
use puma_dyn::{Context, Effects, Model, Payload, Workspace, puma560, rnea};

use crate::states::{State, Uniform};
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

/// Times as many torque vectors as the full data set has: 64,000 samples under each of 15 loads.
pub fn time_data_set() -> Result<()> {
    const SAMPLES: usize = 64_000;
    const LOADS: usize = 15;
    let model = puma560::model();
    let mut workspace = Workspace::new(&model);
    let context = loaded(&model)?;
    let mut uniform = Uniform(15);
    let inputs: Vec<[f64; 18]> = (0..SAMPLES)
        .map(|_| std::array::from_fn(|_| uniform.next()))
        .collect();
    let mut torques = vec![0.0; SAMPLES * LOADS * 6];

    let start = Instant::now();
    for per_load in torques.chunks_exact_mut(SAMPLES * 6) {
        for (x, tau) in inputs.iter().zip(per_load.chunks_exact_mut(6)) {
            let ((q, qd), qdd) = (x[..12].split_at(6), &x[12..]);
            rnea(
                &model,
                &mut workspace,
                Effects::ALL,
                &context,
                q,
                qd,
                qdd,
                tau,
            );
        }
    }
    let seconds = start.elapsed().as_secs_f64();
    black_box(&torques);
    println!(
        "\n{} torque vectors with everything: {seconds:.3} s on one core",
        SAMPLES * LOADS
    );
    Ok(())
}
