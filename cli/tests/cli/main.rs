//! The `mimic` program as its users meet it.

mod disturbed;
mod edit;
mod exit_codes;
mod import;
#[cfg(not(feature = "rerun"))]
mod lean;
mod output;
#[cfg(feature = "rerun")]
mod readme;
#[cfg(feature = "rerun")]
mod replay;
mod shown;
mod spared;
mod stages;
mod talk;
mod training;
mod workbench;
