//! Pictures for people: every stage drawn over the photograph ([`stages`]), contact sheets of models ([`sheet`]) and of every
//! representation of a tree ([`methods`]), a model at a glance ([`preview`]) and beside its photograph ([`resemblance`]); photographs of
//! true trees ([`studio`]) and their models against them ([`circle`]).

pub mod circle;
pub mod draw;
pub mod methods;
pub mod preview;
pub mod resemblance;
pub mod sheet;
pub mod stages;
pub mod studio;
