//! `mimic man`: prints or writes the manual pages.

use crate::args::Replace;
use crate::failure::{Failure, Outcome};
use crate::output::{Form, Maker, Output, make_folder, unmake};
use crate::printer::Printer;
use clap::Command;
use clap_mangen::Man;
use serde_json::json;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  mimic man | man -l -                       read the manual
  mimic man --out ~/.local/share/man/man1    write one page per command";

/// Print the manual page, or write one page per command
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Folder to write mimic.1 and a page per command to
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    replace: Replace,
}

impl Args {
    /// Runs the command.
    pub fn run(self, command: Command, printer: &Printer) -> Outcome {
        let mut command = command.disable_help_subcommand(true);
        command.build();
        let Some(folder) = self.out else {
            let page = page(command)?;
            return printer.result(&json!({ "text": page }), || page.clone());
        };
        let pages = write_pages(&command, &folder, self.replace.force)?;
        printer.result(&json!({ "pages": pages }), || pages.join("\n"))
    }
}

fn write_pages(command: &Command, folder: &Path, force: bool) -> Outcome<Vec<String>> {
    let made = make_folder(folder)?;
    let pages: Outcome<Vec<String>> = std::iter::once(command)
        .chain(command.get_subcommands())
        .map(|command| {
            let name = command.get_display_name().unwrap_or(command.get_name());
            let path = folder.join(format!("{name}.1"));
            let maker = Maker::new("man", [] as [&Path; 0]).with(name);
            let output = Output::new(path, Form::Page, maker, "--out", force);
            output.write_text(&page(command.clone())?)?;
            Ok(output.path().display().to_string())
        })
        .collect();
    if pages.is_err() {
        unmake(&made);
    }
    pages
}

fn page(command: Command) -> Outcome<String> {
    let mut page = Vec::new();
    Man::new(command)
        .render(&mut page)
        .map_err(|e| Failure::print(&e))?;
    Ok(String::from_utf8_lossy(&page).into_owned())
}
