//! `foreframe man`: man pages from the same definitions as the commands.

use std::fs;
use std::path::PathBuf;

use anyhow::Context as _;
use clap::CommandFactory as _;
use serde::Serialize;

use crate::cli::Cli;
use crate::output::Output;

/// Arguments of `foreframe man`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Folder to write the pages to; made if it is not there.
    pub dir: PathBuf,
}

#[derive(Serialize)]
struct Written {
    dir: PathBuf,
    pages: usize,
}

/// Writes one page per command.
///
/// # Errors
/// If the folder or a page cannot be written.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<()> {
    fs::create_dir_all(&args.dir).with_context(|| format!("making {}", args.dir.display()))?;
    let command = Cli::command();
    clap_mangen::generate_to(command.clone(), &args.dir)
        .with_context(|| format!("writing man pages to {}", args.dir.display()))?;
    let written = Written { dir: args.dir.clone(), pages: command.get_subcommands().count() + 1 };
    output.result(&written, &format!("man pages are in {}", written.dir.display()))
}
