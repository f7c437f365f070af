//! Pinocchio's compiled library, driven through a small C++ program that this module builds.
//!
//! The program reads the robot and the states once, then answers one line per request, so that its
//! rounds alternate with the other contestants'.

use std::fmt::Write as _;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use anyhow::{Context, Result, bail, ensure};

use puma_dyn::puma560;
use puma_dyn::robot::Inertial;

use crate::{Contestant, GRAVITY, States};

const SOURCE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/pinocchio/rnea.cpp");

/// Prints the directory that the wheel `pin` unpacks its headers and libraries to.
const LOCATE: &str = "import pinocchio, pathlib; \
    print(pinocchio.__version__); \
    print(next(p for p in pathlib.Path(pinocchio.__file__).parents if p.name == 'cmeel.prefix'))";

pub struct Driver {
    name: String,
    child: Child,
    requests: ChildStdin,
    answers: BufReader<ChildStdout>,
    n_states: usize,
}

impl Driver {
    /// Finds Pinocchio, compiles the program, starts it and hands it the states.
    pub fn start(states: &States) -> Result<Self> {
        let (version, prefix) = locate()?;
        let program = compile(&prefix)?;
        let mut child = Command::new(program)
            .args([GRAVITY.to_string(), states.len().to_string()])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .context("the compiled driver does not start")?;
        let mut requests = child.stdin.take().context("no pipe to the driver")?;
        let answers = BufReader::new(child.stdout.take().context("no pipe from the driver")?);
        requests.write_all(robot_as_text()?.as_bytes())?;
        requests.write_all(states_as_text(states)?.as_bytes())?;
        let name = format!("pinocchio {version} (C++), rigid body");
        Ok(Self {
            name,
            child,
            requests,
            answers,
            n_states: states.len(),
        })
    }

    fn ask(&mut self, request: &str) -> Result<String> {
        writeln!(self.requests, "{request}")?;
        self.requests.flush()?;
        self.line()
    }

    fn line(&mut self) -> Result<String> {
        let mut line = String::new();
        ensure!(self.answers.read_line(&mut line)? > 0, "the driver stopped");
        Ok(line)
    }
}

impl Contestant for Driver {
    fn name(&self) -> &str {
        &self.name
    }

    fn is_rigid_body(&self) -> bool {
        true
    }

    fn torques(&mut self) -> Result<Vec<[f64; 6]>> {
        let mut line = self.ask("torques")?;
        let mut torques = Vec::with_capacity(self.n_states);
        loop {
            let numbers: Vec<f64> = line
                .split_whitespace()
                .map(str::parse)
                .collect::<Result<_, _>>()?;
            torques.push(
                numbers
                    .try_into()
                    .ok()
                    .context("the driver did not print six torques")?,
            );
            if torques.len() == self.n_states {
                return Ok(torques);
            }
            line = self.line()?;
        }
    }

    fn round(&mut self, passes: usize) -> Result<f64> {
        Ok(self.ask(&format!("round {passes}"))?.trim().parse()?)
    }
}

impl Drop for Driver {
    fn drop(&mut self) {
        // The driver ends by itself when its input closes; this is for one that hangs.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Version and installation prefix of the Python package, which carries the C++ library.
fn locate() -> Result<(String, PathBuf)> {
    let python = std::env::var("PINOCCHIO_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let output = Command::new(&python)
        .args(["-c", LOCATE])
        .output()
        .with_context(|| format!("`{python}` cannot be run"))?;
    if !output.status.success() {
        bail!("`{python}` cannot import pinocchio from the wheel `pin`");
    }
    let text = String::from_utf8(output.stdout)?;
    let mut lines = text.lines();
    let (version, prefix) = (lines.next(), lines.next());
    Ok((
        version.context("no version")?.to_owned(),
        prefix.context("no prefix")?.into(),
    ))
}

/// Compiles the driver with the optimisation level that Pinocchio's own benchmarks use.
fn compile(prefix: &Path) -> Result<PathBuf> {
    let program = std::env::temp_dir().join(format!("side-by-side-rnea-{}", std::process::id()));
    let (include, lib) = (prefix.join("include"), prefix.join("lib"));
    let output = Command::new("g++")
        .args([
            "-std=c++17",
            "-O3",
            "-DNDEBUG",
            "-DPINOCCHIO_ENABLE_TEMPLATE_INSTANTIATION",
            // Pinocchio has more joint types than Boost's lists hold by default.
            "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS",
            "-DBOOST_MPL_LIMIT_LIST_SIZE=30",
            SOURCE,
        ])
        .arg("-I")
        .arg(&include)
        .arg("-I")
        .arg(include.join("eigen3"))
        .arg("-L")
        .arg(&lib)
        .arg("-lpinocchio_default")
        .arg(format!("-Wl,-rpath,{}", lib.display()))
        .arg("-o")
        .arg(&program)
        .output()
        .context("g++ cannot be run")?;
    if !output.status.success() {
        let messages = String::from_utf8_lossy(&output.stderr).into_owned();
        let first = messages.lines().find(|line| line.contains("error"));
        bail!("g++ failed: {}", first.unwrap_or(&messages));
    }
    Ok(program)
}

/// One row per joint, as the driver reads them.
///
/// The robot does not go through a URDF: the wheel lacks the headers of its parser, and a URDF's
/// continuous joints would hand Pinocchio the cosine and sine of every angle for free.
fn robot_as_text() -> Result<String> {
    let robot = puma560::description();
    let mut text = String::new();
    for (joint, link) in robot.joints.iter().zip(robot.links.iter().skip(1)) {
        ensure!(
            joint.axis == [0.0, 0.0, 1.0] && joint.child == link.name,
            "not a chain about z"
        );
        let Inertial {
            mass,
            centre,
            inertia,
        } = link.inertial.context("a link without inertia")?;
        let rotation = joint.origin.rotation.transpose(); // stored by columns
        let origin = rotation.iter().chain(&joint.origin.translation);
        for number in origin
            .chain([&mass])
            .chain(&centre)
            .chain(inertia.as_flattened())
        {
            write!(text, "{number} ")?;
        }
        text.push('\n');
    }
    Ok(text)
}

/// One row per state: q, qd, qdd.
fn states_as_text(states: &States) -> Result<String> {
    let mut text = String::new();
    for state in states {
        for number in state.q.iter().chain(&state.qd).chain(&state.qdd) {
            write!(text, "{number} ")?;
        }
        text.push('\n');
    }
    Ok(text)
}
