//! What a data sheet says of a load: mass and first moments, which an arm's torques are affine in.

use faer::Mat;
use mtgp::fit::Descriptors;
use puma_dyn::Payload;

use crate::error::TorqueError;

/// Distance that stands for the size of loads none of which is off the axes of its frame, m.
const ARM: f64 = 0.1;

/// Mass and first moments of what is carried in a context.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadDescription {
    /// m, kg.
    pub mass: f64,
    /// m c in the axes and about the origin of one frame for all loads, kg m.
    pub first_moments: [f64; 3],
}

impl LoadDescription {
    /// Of an arm that carries nothing.
    pub const NOTHING: Self = Self {
        mass: 0.0,
        first_moments: [0.0; 3],
    };

    /// (m, m c), (4,): the descriptors of its context.
    pub fn descriptors(&self) -> [f64; 4] {
        let [x, y, z] = self.first_moments;
        [self.mass, x, y, z]
    }
}

impl From<&Payload> for LoadDescription {
    fn from(payload: &Payload) -> Self {
        Self {
            mass: payload.mass(),
            first_moments: payload.first_moments(),
        }
    }
}

/// Descriptors of contexts by what is carried in each.
///
/// The unit of the mass is its standard deviation over the contexts; that of all first moments, whose axes may be
/// turned, the root mean square of theirs.
/// Where masses do not differ, the unit is their size; where first moments do not, that of the mass at 0.1 m.
/// # Errors
/// [`TorqueError::OtherKind`] for loads that are all the same.
pub fn descriptors(loads: &[LoadDescription]) -> Result<Descriptors, TorqueError> {
    let rows: Vec<[f64; 4]> = loads.iter().map(LoadDescription::descriptors).collect();
    let values = Mat::from_fn(rows.len(), 4, |row, col| rows[row][col]);
    let of_mass = spread(values.col_as_slice(0));
    let of_moments = (1..4).map(|col| spread(values.col_as_slice(col)).powi(2));
    let of_moments = (of_moments.sum::<f64>() / 3.0).sqrt();
    if of_mass <= 0.0 && of_moments <= 0.0 {
        let what = "the loads of all contexts have the same mass and centre: nothing tells what they change";
        return Err(TorqueError::OtherKind {
            what: what.to_owned(),
        });
    }
    let mass = if of_mass > 0.0 {
        of_mass
    } else {
        loads
            .iter()
            .fold(0.0, |most: f64, load| most.max(load.mass))
    };
    let moment = if of_moments > 0.0 {
        of_moments
    } else {
        ARM * mass
    };
    Ok(Descriptors {
        values,
        units: vec![mass, moment, moment, moment],
    })
}

/// Standard deviation; exactly zero for numbers that are equal.
fn spread(values: &[f64]) -> f64 {
    if values
        .iter()
        .all(|value| value.total_cmp(&values[0]).is_eq())
    {
        return 0.0;
    }
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares = values.iter().map(|value| (value - mean).powi(2));
    (squares.sum::<f64>() / n).sqrt()
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "numbers that are exact in binary")]
mod tests {
    use super::*;

    fn load(mass: f64, first_moments: [f64; 3]) -> LoadDescription {
        LoadDescription {
            mass,
            first_moments,
        }
    }

    #[test]
    fn units_are_spreads_of_the_mass_and_of_all_first_moments_together() {
        // Masses 1 and 3: standard deviation 1. First moments: 2 along x only, root mean square 2/√3.
        let loads = [load(1.0, [0.0; 3]), load(3.0, [4.0, 0.0, 0.0])];
        let found = descriptors(&loads).unwrap();
        let moment = 2.0 / 3.0_f64.sqrt();
        assert_eq!(found.units[0], 1.0);
        for unit in &found.units[1..] {
            assert!((unit - moment).abs() <= 4.0 * f64::EPSILON, "{unit}");
        }
        let row: Vec<f64> = found.values.row(1).iter().copied().collect();
        assert_eq!(row, [3.0, 4.0, 0.0, 0.0]);
    }

    #[test]
    fn what_does_not_differ_has_the_size_of_what_does() {
        let on_the_axis = [LoadDescription::NOTHING, load(2.0, [0.0; 3])];
        assert_eq!(
            descriptors(&on_the_axis).unwrap().units,
            [1.0, 0.1, 0.1, 0.1]
        );
        let of_one_mass = [load(2.0, [0.0; 3]), load(2.0, [6.0, 0.0, 0.0])];
        let units = descriptors(&of_one_mass).unwrap().units;
        assert_eq!(units[0], 2.0);
        let same = [load(2.0, [0.5; 3]); 3];
        assert!(descriptors(&same).is_err());
    }
}
