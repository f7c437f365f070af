//! A mapping proposed from the names of columns: what the recorders of the field call things.

use crate::mapping::{Columns, Mapping, matched};
use crate::unit::TimeUnit;

/// Templates of the three quantities that belong together.
struct Family {
    position: &'static str,
    velocity: &'static str,
    efforts: &'static [&'static str],
}

/// Names that go together, by the programs that write them; the first that fits is taken.
const FAMILIES: [Family; 16] = [
    // PlotJuggler and other flattened topics
    Family {
        position: "/joint_states/{}/position",
        velocity: "/joint_states/{}/velocity",
        efforts: &["/joint_states/{}/effort"],
    },
    Family {
        position: "{}/position",
        velocity: "{}/velocity",
        efforts: &["{}/effort"],
    },
    Family {
        position: "{}.position",
        velocity: "{}.velocity",
        efforts: &["{}.effort"],
    },
    Family {
        position: "{}_position",
        velocity: "{}_velocity",
        efforts: &["{}_effort", "{}_torque", "{}_current"],
    },
    // rostopic echo -p
    Family {
        position: "field.position{}",
        velocity: "field.velocity{}",
        efforts: &["field.effort{}"],
    },
    // Universal Robots' RTDE
    Family {
        position: "actual_q_{}",
        velocity: "actual_qd_{}",
        efforts: &["target_moment_{}", "actual_current_{}"],
    },
    // Kinova's Kortex, KUKA and others
    Family {
        position: "Position{}",
        velocity: "Velocity{}",
        efforts: &["TorqueCur{}", "Torque{}", "Effort{}", "Current{}"],
    },
    Family {
        position: "position{}",
        velocity: "velocity{}",
        efforts: &["effort{}", "torque{}", "current{}"],
    },
    Family {
        position: "position_{}",
        velocity: "velocity_{}",
        efforts: &["effort_{}", "torque_{}", "current_{}"],
    },
    Family {
        position: "pos{}",
        velocity: "vel{}",
        efforts: &["eff{}", "effort{}", "torque{}", "tau{}", "current{}"],
    },
    Family {
        position: "pos_{}",
        velocity: "vel_{}",
        efforts: &["eff_{}", "effort_{}", "torque_{}", "tau_{}", "current_{}"],
    },
    // libfranka, Unitree
    Family {
        position: "q[{}]",
        velocity: "dq[{}]",
        efforts: &["tau_J[{}]", "tau[{}]", "torque[{}]", "current[{}]"],
    },
    Family {
        position: "q_{}",
        velocity: "dq_{}",
        efforts: &["tau_J_{}", "tau_{}", "torque_{}", "effort_{}", "current_{}"],
    },
    Family {
        position: "q_{}",
        velocity: "qd_{}",
        efforts: &["tau_{}", "torque_{}", "effort_{}", "current_{}"],
    },
    Family {
        position: "q{}",
        velocity: "dq{}",
        efforts: &[
            "tau_J{}",
            "tau{}",
            "torque{}",
            "effort{}",
            "current{}",
            "i{}",
        ],
    },
    Family {
        position: "q{}",
        velocity: "qd{}",
        efforts: &["tau{}", "torque{}", "effort{}", "current{}", "i{}"],
    },
];

/// Names of stamps, with the unit that goes with them.
const TIMES: [(&str, &str); 14] = [
    ("t", "s"),
    ("time", "s"),
    ("Time", "s"),
    ("timestamp", "s"),
    ("__time", "s"),
    ("t_s", "s"),
    ("time_s", "s"),
    ("t_ms", "ms"),
    ("time_ms", "ms"),
    ("t_us", "us"),
    ("%time", "ns"),
    ("t_ns", "ns"),
    ("time_ns", "ns"),
    ("timestamp_ns", "ns"),
];

/// A mapping of a header; `None` where the names are not known.
///
/// The unit of efforts is left open, and positions are taken for rad, speeds for rad/s.
pub fn guess(header: &[String]) -> Option<Mapping> {
    let joints_of = |template: &str| -> Vec<&str> {
        let names = header.iter().filter_map(|name| matched(template, name));
        names.filter(|joint| is_name(template, joint)).collect()
    };
    let fits = |family: &Family| -> Option<Mapping> {
        let positions = joints_of(family.position);
        let has_all = |template: &str| {
            let others = joints_of(template);
            let common = positions.iter().filter(|joint| others.contains(joint));
            common.count()
        };
        let effort = family
            .efforts
            .iter()
            .find(|template| has_all(template) > 0)?;
        let efforts = joints_of(effort);
        let joints: Vec<&str> = positions
            .iter()
            .copied()
            .filter(|joint| efforts.contains(joint))
            .collect();
        let velocities = joints_of(family.velocity);
        let has_velocity = joints.iter().all(|joint| velocities.contains(joint));
        // A family whose speeds are called otherwise is of another recorder.
        if !has_velocity && !velocities.is_empty() {
            return None;
        }
        let of = |template: &str| Some(Columns::Template(template.to_owned()));
        Some(Mapping {
            position: of(family.position),
            velocity: has_velocity.then(|| of(family.velocity)).flatten(),
            effort: of(effort),
            joints: joints.into_iter().map(str::to_owned).collect(),
            ..Mapping::default()
        })
    };
    let candidates: Vec<Mapping> = FAMILIES.iter().filter_map(fits).collect();
    let with_speeds = candidates.iter().find(|mapping| mapping.velocity.is_some());
    let mut mapping = with_speeds.or(candidates.first())?.clone();
    let named = |name: &str| {
        header
            .iter()
            .any(|column| column == name)
            .then(|| name.to_owned())
    };
    if let Some((name, unit)) = TIMES.iter().find(|(name, _)| named(name).is_some()) {
        mapping.time = Some((*name).to_owned());
        mapping.time_unit = TimeUnit::parse(unit).unwrap_or_default();
    }
    mapping.run = named("run");
    mapping.context = named("context");
    Some(mapping)
}

/// Marks of what was commanded, not measured.
const COMMANDED: [&str; 5] = ["cmd", "des", "target", "ref", "command"];

/// Behind a letter a joint is a number: `q{}` is not the template of `qd1`, nor of `q_1`. Behind a mark it is any name but
/// one of something that was commanded: `q_{}` is not that of `q_cmd_1`.
fn is_name(template: &str, joint: &str) -> bool {
    let before = template.split_once("{}").map_or("", |(before, _)| before);
    if before.ends_with(char::is_alphanumeric) {
        return joint.bytes().all(|byte| byte.is_ascii_digit());
    }
    !joint.split('_').any(|part| COMMANDED.contains(&part))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guessed(names: &str) -> Option<Mapping> {
        guess(&names.split(',').map(str::to_owned).collect::<Vec<_>>())
    }

    #[test]
    fn names_of_known_recorders_are_known() {
        for (names, joints, time) in [
            ("t,q1,q2,dq1,dq2,tau1,tau2", 2, Some("t")),
            ("q1,q2,qd1,qd2,qdd1,qdd2,tau1,tau2", 2, None),
            (
                "timestamp,actual_q_0,actual_q_1,actual_qd_0,actual_qd_1,actual_current_0,actual_current_1",
                2,
                Some("timestamp"),
            ),
            (
                "Time,Position1,Velocity1,Torque1,TorqueSm1,TorqueCur1,PositionCmptd1,VelocityCmptd1",
                1,
                Some("Time"),
            ),
            (
                "__time,/joint_states/elbow/position,/joint_states/elbow/velocity,/joint_states/elbow/effort",
                1,
                Some("__time"),
            ),
            (
                "%time,field.position0,field.velocity0,field.effort0",
                1,
                Some("%time"),
            ),
            ("q[0],q[1],dq[0],dq[1],tau_J[0],tau_J[1]", 2, None),
            (
                "q_j1,q_cmd_j1,dq_j1,dq_cmd_j1,tau_j1,q_j2,dq_j2,tau_j2",
                2,
                None,
            ),
        ] {
            let mapping = guessed(names).unwrap_or_else(|| panic!("{names}"));
            assert_eq!(mapping.joints.len(), joints, "{names}: {mapping:?}");
            assert!(mapping.velocity.is_some(), "{names}: {mapping:?}");
            assert_eq!(mapping.time.as_deref(), time, "{names}");
            assert_eq!(mapping.effort_unit, None);
        }
    }

    #[test]
    fn speeds_may_be_missing_and_unknown_names_are_left() {
        assert_eq!(guessed("t,pos1,pos2,eff1,eff2").unwrap().velocity, None);
        assert_eq!(guessed("a,b,c"), None);
        assert_eq!(guessed("q1,q2,dq1,dq2"), None);
    }
}
