//! `torque-gp sample`: hyperparameters drawn from their posterior, instead of the likeliest ones.

use std::io::Write;
use std::path::PathBuf;

use gp_core::fit::chapter_start;
use gp_core::sampling::{
    Chain, ChainOptions, ChainSummary, HyperPosterior, HyperPrior, Laplace, sample_chains,
};
use gp_core::{FitOptions, GpError, LogMarginal};
use kernels::{Covariance, TorqueForm};
use torque_model::Samples;
use torque_model::learn::own_unit;

use crate::continuous::ContinuousArgs;
use crate::data_args::DataArgs;
use crate::error::CliError;
use crate::messages;
use crate::method::MethodArg;
use crate::output::{self, Output};
use crate::result_table::write_row;
use crate::samples::DataColumns;
use crate::table::Table;
use crate::text_table;

/// R̂ above which chains do not agree.
const LARGEST_R_HAT: f64 = 1.01;

/// Draws that a statement about the middle of a distribution needs.
const SMALLEST_SIZE: f64 = 400.0;

/// Draw the hyperparameters of one joint's torque from their posterior, by Hamiltonian Monte Carlo
///
/// DATA has the columns of `torque-gp fit`; the model is the Gaussian process with Coulomb friction (gpc).
/// The priors are weak: every standard deviation and length scale is log-normal about the data's moments (eq. 22
/// of the chapter), a factor of e² either way for one standard deviation; for the noise's variance e⁴.
/// The chains set out from the likeliest hyperparameters; the result is the same, bit by bit, for any number of
/// processors.
#[derive(clap::Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Args {
    #[command(flatten)]
    data: DataArgs,

    /// Joint whose torques are taken, by number or name
    #[arg(long, value_name = "JOINT")]
    joint: String,

    #[command(flatten)]
    continuous: ContinuousArgs,

    /// Chains
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u16).range(1..=64))]
    chains: u16,

    /// Draws of each chain that are dropped while step size and coordinates are adapted, in stages
    #[arg(long, value_name = "N", default_value_t = 500, value_parser = clap::value_parser!(u32).range(10..=1_000_000))]
    warmup: u32,

    /// Draws of each chain that are kept
    #[arg(long, value_name = "N", default_value_t = 500, value_parser = clap::value_parser!(u32).range(4..=1_000_000))]
    draws: u32,

    /// Trajectories have fewer than 2^N steps
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=12))]
    max_depth: u32,

    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,

    /// How likelihoods are computed
    #[arg(long, value_enum, default_value_t = MethodArg::Dense)]
    method: MethodArg,

    /// Draws, one per row; `-` is standard output
    #[arg(long, value_name = "FILE.csv")]
    output: PathBuf,
}

const EXAMPLES: &str = "\
Examples:
  torque-gp sample --data train.csv --joint 3 --output draws.csv
  torque-gp sample --data log.csv --context c3 --joint elbow --chains 2 --draws 2000 --seed 7 --output draws.csv

Columns of the result: chain and draw (from 1), then the hyperparameters by name, natural values, noise_std last.
Standard error has R̂ and the effective sample size of each hyperparameter, and warns where the chains disagree or
a trajectory diverged. A likelihood takes n³ operations, and a draw up to 2^max-depth of them.

Exit status: 0, or 2 for bad input or usage; then there is one message and no output file.";

/// Reads the data, runs the chains, writes the draws.
///
/// # Errors
/// Anything wrong with the options or the data, or a chain that cannot begin; no output is left.
pub fn run(args: &Args) -> Result<(), CliError> {
    output::check_not_an_input(&args.output, &[&args.data.path])?;
    let mut table = Table::open(&args.data.path)?;
    let file = table.file().to_owned();
    let asked = std::slice::from_ref(&args.joint);
    let columns = DataColumns::of_header(&table, &args.data.tau_prefix, "--joint", asked)?;
    let columns = match args.continuous.named(&columns.joints)? {
        Some(continuous) => columns.with_continuous(&continuous),
        None => columns,
    };
    let mut output = Output::create(&args.output)?;
    let data = columns.read(&mut table, args.data.context.as_deref())?;
    data.warn(&file);
    let mut samples = data.samples;
    samples.continuous = args.continuous.of(&file, &columns.joints, &samples)?;
    // As `fit`: what bounds and starts are depends on the torques' size, not on their unit.
    let torques = &mut samples.torques[0].values;
    let unit = own_unit(torques);
    for torque in torques {
        *torque /= unit;
    }
    let joint = samples.name_of(&samples.torques[0]).to_owned();
    let posterior = Posterior::new(args, &samples);
    let drawn = posterior.and_then(|posterior| {
        let chains = posterior.chains(args)?;
        Ok((posterior.prior, chains))
    });
    let (prior, chains) = drawn.map_err(|cause| CliError::Joint {
        file,
        joint,
        cause: Box::new(cause.into()),
    })?;
    report(&prior, &chains);
    write(&prior, unit, &chains, &mut output).map_err(CliError::io("write", output.name()))?;
    output.commit()
}

/// What the chains draw from, and where they begin.
struct Posterior<'a> {
    args: &'a Args,
    samples: &'a Samples,
    prior: HyperPrior,
    covariance: kernels::TorqueCovariance,
    start: Vec<f64>,
}

impl<'a> Posterior<'a> {
    fn new(args: &'a Args, samples: &'a Samples) -> Result<Self, GpError> {
        let (x, targets) = (samples.x.as_ref(), &samples.torques[0].values);
        let continuous = &samples.continuous;
        let moments = chapter_start(x, targets, TorqueForm::Coulomb, continuous)?;
        let prior = HyperPrior::about(&moments.covariance, moments.noise_std)?;
        let options = FitOptions {
            continuous: continuous.clone(),
            ..FitOptions::several()
        };
        let likeliest = gp_core::fit(x, targets, TorqueForm::Coulomb, &options)?;
        let mut theta = likeliest.covariance().params();
        theta.push(likeliest.noise_std());
        Ok(Self {
            args,
            samples,
            start: prior.start(&theta),
            prior,
            covariance: moments.covariance,
        })
    }

    fn chains(&self, args: &Args) -> Result<Vec<Chain>, GpError> {
        let options = ChainOptions {
            n_warmup: args.warmup as usize,
            n_draws: args.draws as usize,
            max_depth: args.max_depth,
            ..ChainOptions::default()
        };
        let laplace = Laplace::climb(&mut self.density(), &self.start)?;
        let n_chains = u64::from(args.chains);
        sample_chains(|| self.density(), &laplace, &options, n_chains, args.seed)
    }

    fn density(&self) -> HyperPosterior<kernels::TorqueCovariance, LogMarginal<'_>> {
        let (x, targets) = (self.samples.x.as_ref(), &self.samples.torques[0].values);
        let mut options = gp_core::LikelihoodOptions::automatic();
        options.method = self.args.method.method();
        let likelihood = LogMarginal::new(x, targets, options);
        HyperPosterior::new(self.covariance.clone(), likelihood, self.prior.clone())
    }
}

/// R̂ and sizes by name; warnings where they are bad.
fn report(prior: &HyperPrior, chains: &[Chain]) {
    let summary = |col: usize| {
        let values: Vec<Vec<f64>> = (chains.iter())
            .map(|chain| chain.draws.col(col).iter().copied().collect())
            .collect();
        ChainSummary::of(&values)
    };
    let summaries: Vec<ChainSummary> = (0..prior.layout().len()).map(summary).collect();
    let row = |(spec, summary): (&kernels::params::ParamSpec, &ChainSummary)| {
        vec![
            spec.to_string(),
            format!("{:.3}", summary.r_hat),
            format!("{:.0}", summary.bulk_size),
        ]
    };
    let rows: Vec<Vec<String>> = (prior.layout().specs().iter().zip(&summaries))
        .map(row)
        .collect();
    let header = ["hyperparameter", "R̂", "effective size"];
    messages::report(text_table::render(&header, &rows));

    let divergences: usize = chains.iter().map(|chain| chain.n_divergences).sum();
    if divergences > 0 {
        messages::warning(format!(
            "{divergences} trajectories diverged: the draws may miss a part of the posterior"
        ));
    }
    let worst = summaries.iter().map(|s| s.r_hat).fold(0.0, f64::max);
    let smallest = summaries
        .iter()
        .map(|s| s.bulk_size)
        .fold(f64::INFINITY, f64::min);
    if worst > LARGEST_R_HAT || smallest < SMALLEST_SIZE {
        messages::warning(format!(
            "the chains are too short: R̂ up to {worst:.3} (at most {LARGEST_R_HAT}), effective sizes down to {smallest:.0} (at least {SMALLEST_SIZE}); raise --draws and --warmup"
        ));
    }
}

/// The draws, of torques `unit` times as large as those that the chains saw.
fn write(
    prior: &HyperPrior,
    unit: f64,
    chains: &[Chain],
    output: &mut Output,
) -> std::io::Result<()> {
    let layout = prior.layout();
    let size = |name: &str| if name == "length_scales" { 1.0 } else { unit };
    let sizes: Vec<f64> = layout.specs().iter().map(|spec| size(spec.name)).collect();
    let names = prior.layout().specs().iter().map(ToString::to_string);
    let names: Vec<String> = names.collect();
    writeln!(output, "chain,draw,{}", names.join(","))?;
    for (chain_idx, chain) in chains.iter().enumerate() {
        for row in 0..chain.draws.nrows() {
            let z: Vec<f64> = chain.draws.row(row).iter().copied().collect();
            let numbers = [(chain_idx + 1).to_string(), (row + 1).to_string()];
            let theta = prior.natural(&z).into_iter().zip(&sizes);
            let theta: Vec<f64> = theta.map(|(value, size)| value * size).collect();
            write_row(numbers.iter().map(String::as_str), theta.iter(), output)?;
        }
    }
    Ok(())
}
