//! Mask classes: what the application says of pixels whose motion vector does not tell how their
//! colour moves on.
//!
//! Depth and motion are those of one surface per pixel. A shadow, a reflection or a texture that
//! scrolls moves otherwise than the surface that shows it; smoke and glass are a second layer; and
//! some passes write no vector at all. The class says whose motion a cell takes ([`Source`]),
//! before any rung sees the field: so it holds for every method that follows motion, and evidence
//! judges what comes of it like any other motion.
//!
//! Exactness: `f32` that is copied, never computed, but for the scale of the flow.

use rayon::ThreadPool;

use crate::bands::for_each_row;
use crate::plane::Plane;
use crate::trajectory::surface::is_same_surface;

/// What a pixel shows. The code is that of the wire.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum MaskClass {
    /// A surface that its vector belongs to.
    #[default]
    Opaque,
    /// A second layer that lets a surface show through.
    Transparent,
    /// Sparks, smoke, rain.
    Particle,
    /// A shadow that moves otherwise than the surface that it falls on.
    Shadow,
    /// What a surface mirrors.
    Reflection,
    /// A texture that moves on its surface: a screen, water, a scrolling sign.
    AnimatedTexture,
    /// A surface without a vector, or with one that means nothing.
    MotionInvalid,
}

/// Whose motion a cell takes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Source {
    /// Its own vector's.
    Vector,
    /// That of the picture, where it explains the two newest keys, and none where it does not.
    /// Where the two have too little in common to tell, its own vector's.
    Picture,
    /// That of the surface around it, else of the picture, else none: it is held.
    Surroundings,
}

impl MaskClass {
    /// The class with this code; codes that are none count as opaque.
    #[must_use]
    pub const fn from_code(code: u8) -> Self {
        match code {
            1 => Self::Transparent,
            2 => Self::Particle,
            3 => Self::Shadow,
            4 => Self::Reflection,
            5 => Self::AnimatedTexture,
            6 => Self::MotionInvalid,
            _ => Self::Opaque,
        }
    }

    /// Whose motion its cells take, by what `foreframe stability` shows (the sweeps with a mask
    /// beside those without): the picture gains on shadows, reflections, animated textures and
    /// panes of glass, up to 12 dB. Sparks are smaller than what its motion can be found of.
    #[must_use]
    #[inline(always)]
    pub const fn source(self) -> Source {
        match self {
            Self::Opaque | Self::Particle => Source::Vector,
            Self::Transparent | Self::Shadow | Self::Reflection | Self::AnimatedTexture => {
                Source::Picture
            }
            Self::MotionInvalid => Source::Surroundings,
        }
    }
}

/// Cells that are looked at on each side for a neighbour of the same surface.
const REACH: u32 = 8;

/// Gives cells without a motion of their own that of the nearest cell of their surface that has
/// one, along their row and column; the others NaN. Without depth nothing says whose surface a cell
/// is of.
pub(crate) fn fill_invalid(
    pool: &ThreadPool,
    mask: &Plane<u8>,
    depth: &Plane<u32>,
    displacement: &mut Plane<[f32; 2]>,
) {
    let is_invalid = |code: u8| MaskClass::from_code(code).source() == Source::Surroundings;
    if !mask.data().iter().any(|code| is_invalid(*code)) {
        return;
    }
    let (width, height) = (mask.width(), mask.height());
    let vectors = displacement.clone();
    for_each_row(pool, displacement, |y, row| {
        for (x, out) in (0..).zip(row) {
            if !is_invalid(mask.at(x, y)) {
                continue;
            }
            *out = [f32::NAN; 2];
            if depth.data().is_empty() {
                continue;
            }
            let own = depth.at(x, y);
            let is_source =
                |x: u32, y: u32| !is_invalid(mask.at(x, y)) && is_same_surface(own, depth.at(x, y));
            let beside = |step: u32| {
                [
                    x.checked_sub(step).map(|x| (x, y)),
                    Some((x + step, y)).filter(|(x, _)| *x < width),
                    y.checked_sub(step).map(|y| (x, y)),
                    Some((x, y + step)).filter(|(_, y)| *y < height),
                ]
            };
            let found = (1..=REACH)
                .flat_map(|step| beside(step).into_iter().flatten())
                .find(|(x, y)| is_source(*x, *y));
            if let Some((x, y)) = found {
                *out = vectors.at(x, y);
            }
        }
    });
}

/// Whether some cell goes by the picture: of such a class, or left without a motion.
pub(crate) fn asks_for_picture(mask: &Plane<u8>, displacement: &Plane<[f32; 2]>) -> bool {
    mask.data().iter().zip(displacement.data()).any(|(code, d)| goes_by_picture(*code, *d))
}

/// Gives the cells that go by the picture the motion that `flow`, of the same cells, has found
/// there, times `scale`.
pub(crate) fn take_picture(
    mask: &Plane<u8>,
    flow: &Plane<[f32; 2]>,
    scale: f32,
    displacement: &mut Plane<[f32; 2]>,
) {
    let cells = displacement.data_mut().iter_mut().zip(mask.data()).zip(flow.data());
    for ((out, code), flow) in cells {
        if goes_by_picture(*code, *out) {
            *out = flow.map(|d| d * scale);
        }
    }
}

#[inline(always)]
fn goes_by_picture(code: u8, displacement: [f32; 2]) -> bool {
    match MaskClass::from_code(code).source() {
        Source::Vector => false,
        Source::Picture => true,
        Source::Surroundings => displacement[0].is_nan() || displacement[1].is_nan(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{plane, pool};

    #[test]
    fn every_code_of_the_wire_has_its_class_and_others_are_opaque() {
        let classes: Vec<_> = (0..=7).map(MaskClass::from_code).collect();
        assert_eq!(
            classes,
            [
                MaskClass::Opaque,
                MaskClass::Transparent,
                MaskClass::Particle,
                MaskClass::Shadow,
                MaskClass::Reflection,
                MaskClass::AnimatedTexture,
                MaskClass::MotionInvalid,
                MaskClass::Opaque,
            ]
        );
    }

    #[test]
    fn invalid_motion_comes_from_its_own_surface_or_from_nowhere() {
        // A near surface left of column 20, a far one behind it; invalid from 15 to 35.
        let near = 1 << 24;
        let depth = plane(60, 9, |x, _| if x < 20 { near } else { 1 << 20 });
        let mask = plane(60, 9, |x, _| if (15..35).contains(&x) { 6 } else { 0 });
        let vectors = plane(60, 9, |x, _| match x {
            0..15 => [5.0, 1.0],
            15..35 => [99.0, 99.0],
            _ => [-2.0, 0.0],
        });
        let mut found = vectors.clone();
        fill_invalid(&pool(2), &mask, &depth, &mut found);
        for x in 0..60 {
            let expected = match x {
                0..20 => Some([5.0, 1.0]),
                // Farther than the reach from both of its edges' surfaces.
                20..27 => None,
                _ => Some([-2.0, 0.0]),
            };
            let [right, down] = found.at(x, 4);
            assert_eq!((!right.is_nan()).then_some([right, down]), expected, "column {x}");
        }
        // Without invalid cells the vectors are left alone.
        let mut same = vectors.clone();
        fill_invalid(&pool(2), &plane(60, 9, |_, _| 1), &depth, &mut same);
        assert_eq!(same, vectors);
        let mut without_depth = vectors.clone();
        fill_invalid(&pool(1), &mask, &Plane::default(), &mut without_depth);
        assert!((15..35).all(|x| without_depth.at(x, 0)[0].is_nan()));
        assert_eq!(without_depth.at(14, 0), [5.0, 1.0]);
    }

    #[test]
    fn the_picture_leads_the_classes_that_it_is_to_lead_and_no_others() {
        let mask = plane(9, 1, |x, _| x as u8);
        let flow = plane(9, 1, |_, _| [4.0, -2.0]);
        let mut field = plane(9, 1, |x, _| if x == 6 { [f32::NAN; 2] } else { [1.0, 1.0] });
        assert!(asks_for_picture(&mask, &field));
        take_picture(&mask, &flow, 0.5, &mut field);
        for x in 0..9 {
            let expected = if x == 1 || (3..=6).contains(&x) { [2.0, -1.0] } else { [1.0, 1.0] };
            assert_eq!(field.at(x, 0), expected, "class {x}");
        }
        assert!(!asks_for_picture(&plane(9, 1, |_, _| 2), &field));
    }
}
