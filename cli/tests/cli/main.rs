//! The `mimic` program as its users meet it.

mod disturbed;
mod edit;
mod exit_codes;
mod import;
mod output;
mod readme;
mod replay;
mod stages;
mod talk;
mod training;
mod workbench;
