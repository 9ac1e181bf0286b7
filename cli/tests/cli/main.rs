//! The `mimic` program as its users meet it.

mod exit_codes;
mod output;
mod readme;
mod replay;
mod stages;
mod training;
mod workbench;
