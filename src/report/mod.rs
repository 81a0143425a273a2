//! Pictures for people: every stage drawn over the photograph ([`stages`]), contact sheets ([`sheet`]), a model at a glance
//! ([`preview`]) and beside its photograph ([`resemblance`]); photographs of true trees ([`studio`])
//! and their models against them ([`circle`]).

pub mod circle;
pub mod draw;
pub mod preview;
pub mod resemblance;
pub mod sheet;
pub mod stages;
pub mod studio;
