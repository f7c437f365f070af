//! The crate dynibo 0.5, rigid body only (it has neither friction nor rotors).

use std::hint::black_box;
use std::time::Instant;

use anyhow::Result;

use crate::states::State;
use crate::{Contestant, States};

/// The PUMA's URDF, which holds the same rigid bodies as the built-in table.
const URDF: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/puma560.urdf");

struct Dynibo<'a> {
    robot: dynibo::Robot,
    states: &'a States,
}

pub fn dynibo(states: &States) -> Result<Box<dyn Contestant + '_>> {
    Ok(Box::new(Dynibo {
        robot: dynibo::Robot::from_urdf(URDF)?,
        states,
    }))
}

impl Contestant for Dynibo<'_> {
    fn name(&self) -> &str {
        "dynibo 0.5, rigid body"
    }

    fn is_rigid_body(&self) -> bool {
        true
    }

    fn torques(&mut self) -> Result<Vec<[f64; 6]>> {
        let mut tau = [0.0; 6];
        let call = |State { q, qd, qdd }: &State| {
            self.robot.inverse_dynamics(q, qd, qdd, &[], &mut tau)?;
            Ok(tau)
        };
        self.states.iter().map(call).collect()
    }

    fn round(&mut self, passes: usize) -> Result<f64> {
        let mut tau = [0.0; 6];
        let start = Instant::now();
        for _ in 0..passes {
            for State { q, qd, qdd } in self.states {
                self.robot.inverse_dynamics(q, qd, qdd, &[], &mut tau)?;
                black_box(&tau);
            }
        }
        Ok(start.elapsed().as_secs_f64() * 1e9 / (passes * self.states.len()) as f64)
    }
}
