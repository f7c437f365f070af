//! The contestants in Rust for `peers.py`, and the data and hyperparameters that all contestants share.
//!
//! ```text
//! likelihood data --load c2 --joint 3 --output data.csv
//! likelihood data --loads 14 --joint 3 --output data.csv
//! likelihood fit --data data.csv --n 1004 --model full --output joint3.toml
//! likelihood serve --data data.csv --hyperparameters joint3.toml --n 4000
//! ```
//! `serve` reads one request a line, `CONTESTANT SHIFT [CERTIFICATE]`, and answers each with one
//! line of JSON: seconds, value, error bound, rank and gradient.

mod contestant;
mod data;
mod fit;
mod hyperparameters;
mod ours;
mod serve;
mod theirs;

use std::path::PathBuf;

use anyhow::Result;
use clap::{Parser, Subcommand};

use crate::fit::Model;

#[derive(Parser)]
#[command(about = "Contestants in Rust of peers.py, and the data they share")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Write the 4000 training samples of a load: 2000 of (p2, s3), 2000 of its own trajectory
    Data {
        #[arg(long, default_value = "c2")]
        load: String,
        /// Joint whose torque is the target, from 1
        #[arg(long, default_value_t = 3)]
        joint: usize,
        /// Torques of an arm without friction, for a model without a friction term
        #[arg(long)]
        frictionless: bool,
        /// So many loads c1, c2, … instead of one, 4000 samples of each
        #[arg(long, conflicts_with_all = ["load", "frictionless"])]
        loads: Option<usize>,
        #[arg(long)]
        output: PathBuf,
    },
    /// Learn hyperparameters from the first samples of a file
    Fit {
        #[arg(long)]
        data: PathBuf,
        #[arg(long, default_value_t = 1004)]
        n: usize,
        #[arg(long, value_enum)]
        model: Model,
        #[arg(long)]
        output: PathBuf,
    },
    /// Evaluate likelihoods on request
    Serve {
        #[arg(long)]
        data: PathBuf,
        #[arg(long)]
        hyperparameters: PathBuf,
        #[arg(long, default_value_t = 4000)]
        n: usize,
    },
}

fn main() -> Result<()> {
    match Arguments::parse().command {
        Command::Data {
            load,
            joint,
            frictionless,
            loads,
            output,
        } => match loads {
            None => data::write(&load, joint, frictionless, &output),
            Some(n_loads) => data::write_several(n_loads, joint, &output),
        },
        Command::Fit {
            data,
            n,
            model,
            output,
        } => fit::write(&data::read(&data, n)?, model, &output),
        Command::Serve {
            data,
            hyperparameters,
            n,
        } => serve::serve(
            &data::read(&data, n)?.into_rows()?,
            &hyperparameters::Hyperparameters::read(&hyperparameters)?,
        ),
    }
}
