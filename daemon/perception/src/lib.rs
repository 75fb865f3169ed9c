//! Models of the display and of the eye. Pure: numbers in, numbers out.
//!
//! What an application's frames become on the way to the mind, in order: [`display`] turns codes
//! into light, [`sensitivity`] says which contrast of it is seen, and [`detection`] how likely.
//! [`tracking`] says how much of a motion the eye can follow.
//!
//! Every formula names its author, year and number, and every constant comes from there: none was
//! fitted here. Units are in the names or beside them: cd/m2, degrees of visual angle (deg), cycles
//! per degree (cpd), pixels per degree (ppd), Hz, seconds. All functions of real numbers go through
//! `libm`, so that one input gives one output on every machine.

pub mod banding;
pub mod compensation;
pub mod detection;
pub mod display;
mod error;
pub mod flicker;
pub mod motion_quality;
pub mod multiplex;
pub mod plane;
pub mod retina;
pub mod sensitivity;
pub mod tracking;
pub mod window;

pub use error::PerceptionError;
