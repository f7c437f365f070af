//! `torque-gp export`: what a model identified of a robot, for every other program.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use torque_model::TorqueError;
use torque_model::rigid_body::{IdentifiedLoad, ParameterPosterior};

use crate::error::CliError;
use crate::messages;
use crate::model_file::ModelFile;
use crate::output::{self, Output};
use crate::row_contexts::number_in;

/// Write the robot that a model identified: URDF, sidecar, payload
///
/// The URDF is that of the fit, with the identified mass, centre and inertia of every moving link, of the arm without a
/// load, and with the viscous friction of its joints; links behind fixed joints are part of what they are fixed to.
/// The sidecar has the rotors and the rest of the friction; a payload file has the load of a context.
/// What was learned of links or a load and is not that of a body is written as the nearest by its covariance, and a note
/// says so.
/// `torque-gp inverse-dynamics` on them gives what `predict` gives; a note says what they cannot say.
#[derive(clap::Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Args {
    /// Model file of `torque-gp fit --model rbd`
    #[arg(long, value_name = "FILE.tgp")]
    model: PathBuf,

    /// The identified URDF
    #[arg(long, value_name = "FILE.urdf")]
    urdf: Option<PathBuf>,

    /// Its sidecar
    #[arg(long, value_name = "FILE.toml")]
    sidecar: Option<PathBuf>,

    /// A context, and a file for what it carries
    #[arg(long, value_names = ["CONTEXT", "FILE.toml"], num_args = 2)]
    payload_of: Vec<String>,
}

const EXAMPLES: &str = "\
Examples:
  torque-gp export --model arm.tgp --urdf identified.urdf --sidecar motors.toml
  torque-gp export --model arm.tgp --payload-of cube cube.toml
  torque-gp inverse-dynamics --robot identified.urdf --sidecar motors.toml --payload cube.toml \\
      --input motion.csv --output torques.csv

Exit status: 0, or 2 for bad input or usage; then there is one message and no output file.";

/// Reads a model, writes what was identified.
///
/// # Errors
/// A model of another kind, a context that it does not have or that carries nothing, masses that are not positive,
/// files that cannot be written; then none is.
pub fn run(args: &Args) -> Result<(), CliError> {
    let payload = match args.payload_of.as_slice() {
        [context, file] => Some((context, PathBuf::from(file))),
        _ => None,
    };
    let asked = [
        ("--urdf", args.urdf.as_deref()),
        ("--sidecar", args.sidecar.as_deref()),
        ("--payload-of", payload.as_ref().map(|of| of.1.as_path())),
    ];
    let asked = asked.into_iter();
    let paths: Vec<(&str, &Path)> = asked
        .filter_map(|(option, path)| Some((option, path?)))
        .collect();
    if paths.is_empty() {
        return Err(CliError::Usage(
            "nothing to write: say --urdf FILE.urdf, --sidecar FILE.toml or --payload-of CONTEXT FILE.toml".to_owned(),
        ));
    }
    for (option, path) in &paths {
        output::check_option_not_an_input(option, path, &[&args.model])?;
    }
    output::check_different(&paths)?;
    let model = ModelFile::load(&args.model)?;
    let refused = |what: &str| CliError::Usage(format!("{}: {what}", model.file));
    let (Some(posterior), Some(source)) = (model.rigid_body(), &model.parts().robot) else {
        return Err(refused(
            "no parameters of a robot were learned: `torque-gp fit --model rbd`",
        ));
    };
    let of_model = |cause: TorqueError| CliError::of_data(&model.file)(cause);
    let (mut texts, mut notes): (Vec<(&Path, String)>, Vec<String>) = (Vec::new(), Vec::new());
    if args.urdf.is_some() || args.sidecar.is_some() {
        let robot = posterior.to_robot(source).map_err(of_model)?;
        notes.extend(robot.notes);
        match &args.urdf {
            Some(path) => {
                notes.extend(note_of_projected(path, posterior, &robot.projected));
                texts.push((path, robot.urdf));
            }
            None => {
                notes.push("viscous friction stands in the URDF, which --urdf writes".to_owned());
            }
        }
        texts.extend(args.sidecar.as_deref().map(|path| (path, robot.sidecar)));
    }
    if let Some((context, path)) = &payload {
        let number = number_in("--payload-of", context, model.contexts(), &model.file)?;
        let load = posterior.to_load(number).map_err(of_model)?;
        let load = load.ok_or_else(|| refused(&format!("`{context}` carries nothing")))?;
        if load.is_projected {
            notes.push(format!(
                "{}: what was learned of `{context}` is not that of a body; the nearest by its covariance is written",
                path.display()
            ));
        }
        texts.push((path, payload_text(context, &load, posterior)));
    }
    write_all(texts, notes)
}

/// Which links could not be written as they were learned.
fn note_of_projected(
    path: &Path,
    posterior: &ParameterPosterior,
    joints: &[usize],
) -> Option<String> {
    let names = posterior.parts().robot.joint_names();
    let moved: Vec<String> = (joints.iter())
        .map(|joint| format!("`{}`", names[*joint].escape_debug()))
        .collect();
    (!moved.is_empty()).then(|| {
        format!(
            "{}: what was learned of the link that moves with {} is not that of a body; the nearest bodies by their \
             covariance are written",
            path.display(),
            moved.join(", ")
        )
    })
}

/// Every file is whole, and what there is to say said, before the first takes its place.
fn write_all(texts: Vec<(&Path, String)>, notes: Vec<String>) -> Result<(), CliError> {
    let mut outputs = Vec::new();
    for (path, text) in texts {
        let mut output = Output::create(path)?;
        let name = output.name().to_owned();
        output
            .write_all(text.as_bytes())
            .and_then(|()| output.flush())
            .map_err(CliError::io("write", name))?;
        outputs.push(output);
    }
    notes.into_iter().for_each(messages::note);
    for output in outputs {
        let name = output.name().to_owned();
        output.commit()?;
        messages::note(format!("{name} written"));
    }
    Ok(())
}

fn payload_text(context: &str, load: &IdentifiedLoad, posterior: &ParameterPosterior) -> String {
    let [x, y, z] = load.centre;
    let mut text = format!(
        "# what `{}` carries, as identified\n",
        context.escape_debug()
    );
    let last = posterior.parts().robot.joint_names().last();
    let _ = writeln!(
        text,
        "# in the axes of the link that {} moves",
        last.map_or("the last joint", String::as_str)
    );
    let _ = writeln!(
        text,
        "mass = {:?}\ncentre = [{x:?}, {y:?}, {z:?}]",
        load.mass
    );
    let entries: Vec<String> = load
        .inertia
        .iter()
        .map(|entry| format!("{entry:?}"))
        .collect();
    let _ = writeln!(text, "inertia = [{}]", entries.join(", "));
    text
}
