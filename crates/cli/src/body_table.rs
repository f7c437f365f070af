//! The ten inertial parameters of a body as lines of a table.

use std::ops::Range;

use torque_model::rigid_body::ParameterPosterior;

/// Names and units of the ten parameters, in their order.
pub const PARAMETERS: [(&str, &str); 10] = [
    ("m", "kg"),
    ("m cx", "kg m"),
    ("m cy", "kg m"),
    ("m cz", "kg m"),
    ("Ixx", "kg m²"),
    ("Ixy", "kg m²"),
    ("Iyy", "kg m²"),
    ("Ixz", "kg m²"),
    ("Iyz", "kg m²"),
    ("Izz", "kg m²"),
];

/// Lines with name, value, standard deviation and unit of ten unknowns.
pub fn body_rows(posterior: &ParameterPosterior, unknowns: Range<usize>) -> Vec<Vec<String>> {
    let std = posterior.std();
    let row = |(unknown, (name, unit)): (usize, (&str, &str))| {
        vec![
            name.to_owned(),
            format!("{:.4e}", posterior.mean()[unknown]),
            format!("{:.1e}", std[unknown]),
            unit.to_owned(),
        ]
    };
    unknowns.zip(PARAMETERS).map(row).collect()
}
