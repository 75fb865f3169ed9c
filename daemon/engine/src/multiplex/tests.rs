//! Laws of multiplexing: light is that of full pictures, and only pairs make up for each other.

use std::cmp::Ordering;
use std::num::NonZeroUsize;

use foreframe_perception::compensation::LightTable;

use super::*;
use crate::color::{ColorFormat, OrderedRgba16, Rgb10a2, Rgba8, half_to_ordered};
use crate::engine::start_pool;
use crate::finish::shares::light_tables;
use crate::simd::Simd;
use crate::time::{MonoSpan, MonoTime};

const FULL: [u32; 2] = [48, 40];
const SMALL: [u32; 2] = [24, 20];

fn pool(threads: usize, simd: Simd) -> ThreadPool {
    start_pool(NonZeroUsize::new(threads).unwrap(), simd, || ())
}

fn format(color: ColorFormat) -> StreamFormat {
    StreamFormat {
        color,
        valid_rect_use: ValidRectUse::Multiplex,
        ..StreamFormat::rgba8(FULL[0], FULL[1])
    }
}

/// Noise of `full` levels that goes to both ends of the range, of which four neighbours in a square
/// always have a whole mean; and those means.
fn noise(last: u32, seed: u32) -> [Vec<[u16; 4]>; 2] {
    let random = |x: u32, y: u32, channel: u32| {
        let mixed = (x * 0x9e37 + y * 0x85eb + channel * 0xc2b3 + seed).wrapping_mul(0x27d4_eb2f);
        (mixed ^ (mixed >> 15)).wrapping_mul(0x1656_67b1) >> 8
    };
    let mean = |x, y, channel| 1 + random(x, y, channel) % (last - 1);
    let level = |x: u32, y: u32, channel| {
        let mean = mean(x / 2, y / 2, channel);
        let room = mean.min(last - mean);
        let off = random(x / 2 + 99, y / 2 + 2 * (y % 2), channel) % (room + 1);
        if x.is_multiple_of(2) { mean + off } else { mean - off }
    };
    let all = |[width, height]: [u32; 2], of: &dyn Fn(u32, u32, u32) -> u32| {
        let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        places.map(|(x, y)| [0, 1, 2, 3].map(|channel| of(x, y, channel) as u16)).collect()
    };
    [all(FULL, &level), all(SMALL, &mean)]
}

/// A plane of the full size that has `pixels` of `size` in its upper left.
fn plane(color: ColorFormat, size: [u32; 2], pixels: &[[u16; 4]]) -> ColorPlane {
    fn filled<T: Texel>(
        size: [u32; 2],
        pixels: &[[u16; 4]],
        of: impl Fn([u16; 4]) -> T,
    ) -> Plane<T> {
        let mut plane = Plane::new(FULL[0], FULL[1]);
        for (y, line) in (0..).zip(pixels.chunks(size[0] as usize)) {
            for (texel, pixel) in plane.row_mut(y).iter_mut().zip(line) {
                *texel = of(*pixel);
            }
        }
        plane
    }
    match color {
        ColorFormat::Rgba8 => ColorPlane::Rgba8(filled(size, pixels, Rgba8::of_channels)),
        ColorFormat::Rgb10a2 => {
            let opaque = |[r, g, b, _]: [u16; 4]| Rgb10a2::of_channels([r, g, b, 3]);
            ColorPlane::Rgb10a2(filled(size, pixels, opaque))
        }
        ColorFormat::Rgba16f => {
            let black = half_to_ordered(0);
            let half = |levels: [u16; 4]| OrderedRgba16(levels.map(|level| black + level));
            ColorPlane::Rgba16f(filled(size, pixels, half))
        }
    }
}

fn channels(plane: &ColorPlane) -> Vec<[u16; 4]> {
    match plane {
        ColorPlane::Rgba8(plane) => plane.data().iter().map(|it| it.channels()).collect(),
        ColorPlane::Rgb10a2(plane) => plane.data().iter().map(|it| it.channels()).collect(),
        ColorPlane::Rgba16f(plane) => plane.data().iter().map(|it| it.channels()).collect(),
    }
}

/// A stream that is fed key by key.
struct Stream {
    multiplex: Multiplex,
    pool: ThreadPool,
    newest: Option<KeyFrame>,
    is_cut: bool,
}

impl Stream {
    fn new(color: ColorFormat, pool: ThreadPool) -> Self {
        let multiplex = Multiplex::new(&format(color), &FinishConfig::default()).unwrap();
        Self { multiplex, pool, newest: None, is_cut: false }
    }

    fn push(&mut self, color: ColorPlane, reduced: Option<&ColorPlane>) -> &KeyFrame {
        let valid = Rect::full(FULL[0], FULL[1]);
        let mut key = KeyFrame { color, valid, is_cut: self.is_cut, ..KeyFrame::default() };
        let part = Rect::full(SMALL[0], SMALL[1]);
        let reduced = reduced.map(|plane| (plane, part));
        self.multiplex.take_key(&self.pool, reduced, self.newest.as_ref(), &mut key);
        self.newest.insert(key)
    }

    fn full(&mut self, color: &ColorPlane) -> &KeyFrame {
        self.push(color.clone(), None)
    }

    fn reduced(&mut self, color: &ColorPlane) -> &KeyFrame {
        let empty = ColorPlane::new(color.format(), FULL[0], FULL[1]);
        self.push(empty, Some(color))
    }
}

const FORMATS: [(ColorFormat, u32); 3] = [
    (ColorFormat::Rgba8, 255),
    (ColorFormat::Rgb10a2, 1023),
    // Halves from 0 to 1.
    (ColorFormat::Rgba16f, 0x3c00),
];

/// How many channels of two pictures in a row have more or less light than two of `wanted`, by more
/// than half a level for each.
fn off(tables: &[LightTable; 3], wanted: &[[u16; 4]], shown: [&[[u16; 4]]; 2]) -> usize {
    let mut count = 0;
    for (place, wanted) in wanted.iter().enumerate() {
        for (channel, table) in tables.iter().enumerate() {
            let [first, second] = shown.map(|picture| picture[place][channel]);
            let sum = i64::from(table.light(first)) + i64::from(table.light(second));
            let asked = 2 * i64::from(table.light(wanted[channel]));
            // The level above may be the half that is further.
            let room = [first, second].map(|level| i64::from(table.half_level(level)) + 1);
            count += usize::from((sum - asked).abs() > room[0] + room[1]);
        }
    }
    count
}

#[test]
fn where_nothing_moves_two_keys_have_the_light_of_two_full_ones_clipped_or_not() {
    for (color, last) in FORMATS {
        let [full, small] = noise(last, 7);
        let (full, small) = (plane(color, FULL, &full), plane(color, SMALL, &small));
        let mut stream = Stream::new(color, pool(2, Simd::Widest));
        stream.reduced(&small);
        let even = channels(&stream.full(&full).color);
        let restored = channels(stream.newest.as_ref().unwrap().compared());
        let odd = channels(&stream.reduced(&small).color);
        let alpha = channels(stream.newest.as_ref().unwrap().compared());
        assert_eq!(restored, alpha, "{color:?}: what keys are compared by stays");
        let tables = light_tables(&format(color), &FinishConfig::default()).unwrap();
        let wanted = channels(&full);
        assert_eq!(off(&tables, &wanted, [&even, &odd]), 0, "{color:?}");
        // Neither of the two steps does it alone, and the picture reaches the ends of the range.
        assert!(off(&tables, &wanted, [&wanted, &odd]) > wanted.len() / 2, "{color:?}");
        assert!(off(&tables, &wanted, [&even, &alpha]) > 50, "{color:?}: nothing was clipped");
    }
}

#[test]
fn what_was_clipped_is_left_out_where_the_picture_has_changed() {
    let color = ColorFormat::Rgba8;
    let dots = |x: usize| if x.is_multiple_of(2) { [255; 4] } else { [0; 4] };
    let full: Vec<_> = (0..48 * 40).map(dots).collect();
    let (bright, dark) = (vec![[128; 4]; 24 * 20], vec![[20; 4]; 24 * 20]);
    let (full, bright, dark) =
        (plane(color, FULL, &full), plane(color, SMALL, &bright), plane(color, SMALL, &dark));
    let mut stream = Stream::new(color, pool(1, Simd::Widest));
    stream.reduced(&bright);
    stream.full(&full);
    let same = stream.reduced(&bright);
    assert_ne!(same.color, same.steady, "the same again: the rest is added");
    stream.full(&full);
    let other = stream.reduced(&dark);
    let changed = channels(&other.color).iter().zip(channels(&other.steady)).any(|(a, b)| *a != b);
    assert!(!changed, "a contrast of three quarters is motion");
}

#[test]
fn a_full_key_makes_up_only_for_one_that_takes_turns_with_it() {
    let color = ColorFormat::Rgba8;
    let [full, small] = noise(255, 3);
    let (full, small) = (plane(color, FULL, &full), plane(color, SMALL, &small));
    let mut stream = Stream::new(color, pool(1, Simd::Widest));
    assert_eq!(stream.full(&full).color, full, "the first of all");
    assert_eq!(stream.full(&full).color, full, "after a full one");
    let odd = stream.reduced(&small);
    assert_eq!(odd.color, odd.steady, "nobody has made up for it");
    assert_ne!(stream.full(&full).color, full, "after a reduced one");
    assert_eq!(stream.full(&full).color, full, "the reduced one in between was lost");
    stream.reduced(&small);
    stream.is_cut = true;
    assert_eq!(stream.full(&full).color, full, "a cut");
    let odd = stream.reduced(&small);
    assert_eq!(odd.color, odd.steady, "a reduced cut");
}

#[test]
fn a_flat_picture_stays_as_it_is_at_any_reduction() {
    for (color, last) in FORMATS {
        let level = (last / 3) as u16;
        let pixels = vec![[level; 4]; (FULL[0] * FULL[1]) as usize];
        let flat = plane(color, FULL, &pixels);
        for size in [[12, 10], [19, 16], [24, 20], [36, 39], [48, 39], [1, 1]] {
            let part = Rect::full(size[0], size[1]);
            let mut stream = Stream::new(color, pool(1, Simd::Widest));
            let mut key = KeyFrame { color: flat.clone(), ..KeyFrame::default() };
            let reduced = Some((&flat, part));
            stream.multiplex.take_key(&stream.pool, reduced, None, &mut key);
            assert_eq!(key.color, flat, "{color:?} {size:?}");
            assert_eq!(stream.full(&flat).color, flat, "{color:?} {size:?}");
            assert_eq!(stream.newest.as_ref().unwrap().steady, flat, "{color:?} {size:?}");
        }
    }
}

#[test]
fn pictures_do_not_depend_on_threads_or_registers() {
    for (color, last) in FORMATS {
        let [full, small] = noise(last, 11);
        let (full, small) = (plane(color, FULL, &full), plane(color, SMALL, &small));
        let make = |threads, simd| {
            let mut stream = Stream::new(color, pool(threads, simd));
            stream.reduced(&small);
            [stream.full(&full).color.clone(), stream.reduced(&small).color.clone()]
        };
        let one = make(1, Simd::Portable);
        assert!(one == make(1, Simd::Widest) && one == make(5, Simd::Widest), "{color:?}");
    }
}

#[test]
fn a_reduced_pixel_is_the_mean_of_what_it_covers() {
    let color = ColorFormat::Rgba8;
    // A step in column 24: at 19 columns, one reduced pixel has half of either side.
    let step = |x: usize| if x % 48 < 24 { [0; 4] } else { [200; 4] };
    let full: Vec<_> = (0..48 * 40).map(step).collect();
    let full = plane(color, FULL, &full);
    let side = |x: u32| match (x % 19).cmp(&9) {
        Ordering::Less => [0; 4],
        Ordering::Equal => [100; 4],
        Ordering::Greater => [200; 4],
    };
    let small = (0..19 * 16).map(side);
    let small = plane(color, [19, 16], &small.collect::<Vec<_>>());
    let mut stream = Stream::new(color, pool(1, Simd::Widest));
    let mut key = KeyFrame { color: full.clone(), ..KeyFrame::default() };
    let part = Rect::full(19, 16);
    stream.multiplex.take_key(&stream.pool, Some((&small, part)), None, &mut key);
    let alpha = channels(&key.color);
    stream.full(&full);
    let low = channels(&stream.newest.as_ref().unwrap().steady);
    let most = alpha.iter().zip(&low).map(|(a, b)| a[0].abs_diff(b[0])).max().unwrap();
    assert!(most <= 1, "{most}");
}

#[test]
fn a_still_stream_that_takes_turns_is_no_cut_and_has_no_motion() {
    use crate::engine::{Engine, EngineConfig};
    use crate::key::{KeyInput, PlaneInput};
    use crate::method::Method;

    let [full, small] = noise(255, 5);
    let bytes = |pixels: &[[u16; 4]]| -> Vec<u8> {
        pixels.iter().flatten().map(|level| *level as u8).collect()
    };
    let (full, small) = (bytes(&full), bytes(&small));
    let config = EngineConfig::new(Method::Flow, NonZeroUsize::MIN);
    let mut engine = Engine::new(format(ColorFormat::Rgba8), config);
    let mut shown = Vec::new();
    for index in 0..6_u64 {
        let is_full = index.is_multiple_of(2);
        let mut padded = vec![0; full.len()];
        for (line, row) in padded.chunks_mut(48 * 4).zip(small.chunks(24 * 4)) {
            line[..row.len()].copy_from_slice(row);
        }
        let mut color = PlaneInput::packed(if is_full { &full } else { &padded }, FULL, 4);
        if !is_full {
            color.valid = Rect::full(SMALL[0], SMALL[1]);
        }
        let at = MonoTime::ZERO + MonoSpan::from_ms(8 * (1 + index as i64));
        let key = KeyInput {
            index,
            content_time: at,
            motion_from: None,
            is_cut: false,
            color,
            depth: None,
            motion: None,
            mask: None,
            camera: None,
            motion_from_camera: None,
        };
        engine.push_key(&key).unwrap();
        let mut pictures = [ColorPlane::default(), ColorPlane::default()];
        for (ms, out) in [0, 4].into_iter().zip(&mut pictures) {
            engine.synthesise(at + MonoSpan::from_ms(ms), out).unwrap();
        }
        let [key, between] = pictures;
        assert!(key == between, "key {index}: nothing moves");
        shown.push(key);
    }
    assert_eq!(shown[2], shown[4]);
    assert_eq!(shown[3], shown[5]);
    assert_ne!(shown[0], shown[2], "the first of all has nobody to make up for");
    assert_ne!(shown[2], shown[3]);
}
