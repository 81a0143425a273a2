//! Pictures for people: every stage drawn over the photograph ([`stages`]), and contact sheets ([`sheet`]).

pub mod draw;
pub mod resemblance;
pub mod sheet;
pub mod stages;
