//! The undecimated Laplacian pyramid of the flicker model.
//!
//! Each band is the difference of two successive low-pass planes, all of the picture's size. The
//! first holds what is around half a cycle per pixel, each next one an octave less. The last is the
//! low-pass plane that remains, at 2 cpd or just below: it has to hold all slower change, even of
//! the whole picture, or a screen that flickers evenly would not flicker at all.
//!
//! The frequency that a band is named and weighed by is the published one, the Nyquist frequency of
//! its layer. Its filter is most open near half of that; the parameters were fitted with the names.

use crate::plane::Plane;

/// The lowest band is the first whose frequency is not above this, cpd (Denes 2020, section 7.1).
pub const LOWEST_CPD: f64 = 2.0;

/// Binomial low-pass of each step (Burt and Adelson 1983, a = 3/8).
const KERNEL: [f32; 5] = [0.0625, 0.25, 0.375, 0.25, 0.0625];

/// The bands of one picture. They add up to it.
#[derive(Clone, PartialEq, Debug)]
pub struct Bands {
    planes: Vec<(Plane, f64)>,
}

impl Bands {
    /// The frequencies of the bands at `ppd` pixels per degree, cpd: 26, 13, 6.5, 3.25, 1.625 at
    /// 52.
    pub fn frequencies(ppd: f64) -> impl Iterator<Item = f64> {
        let mut next = Some(ppd / 2.0);
        core::iter::from_fn(move || {
            let cpd = next?;
            next = (cpd > LOWEST_CPD).then_some(cpd / 2.0);
            Some(cpd)
        })
    }

    /// Splits a plane.
    #[must_use]
    pub fn split(plane: &Plane, ppd: f64) -> Self {
        let frequencies: Vec<f64> = Self::frequencies(ppd).collect();
        let mut planes = Vec::with_capacity(frequencies.len());
        let (mut left, mut spread) = (plane.clone(), 1);
        for (index, &cpd) in frequencies.iter().enumerate() {
            if index + 1 == frequencies.len() {
                planes.push((left, cpd));
                break;
            }
            let lower = left.convolved(&KERNEL, spread);
            planes.push((left.zip(&lower, |left, lower| left - lower), cpd));
            (left, spread) = (lower, spread * 2);
        }
        Self { planes }
    }

    /// Each band with its frequency in cpd, finest first.
    pub fn iter(&self) -> impl Iterator<Item = (&Plane, f64)> {
        self.planes.iter().map(|(plane, cpd)| (plane, *cpd))
    }
}
