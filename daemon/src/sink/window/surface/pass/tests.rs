//! What the pass draws, against the CPU's conversion, on every adapter of the machine.

use foreframe_engine::backend::gpu::test_adapters::test_gpus;
use foreframe_engine::color::half_to_ordered;
use half::f16;
use wgpu::{SurfaceColorSpace, TextureFormat};

use super::*;
use crate::sink::srgb::SrgbConverter;
use crate::sink::window::texels::{ByteOrder, Texels};

const SIZE: [u32; 2] = [128, 64];

/// Draws on a texture instead of a surface, and gives its bytes back, row by row.
fn drawn(
    gpu: &Gpu,
    stream: &StreamFormat,
    surface: &SurfaceFormat,
    frame: &ColorPlane,
    placement: &Placement,
) -> Vec<u8> {
    let [width, height] = placement.buffer;
    let target = gpu.device().create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: surface.texture,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let mut pass = Pass::new(gpu, stream, surface).expect("a pass");
    pass.draw(gpu, &Picture::Here(frame), placement, &target).expect("a picture");
    let row = surface.texture.block_copy_size(None).expect("bytes") * width;
    let stride = row.next_multiple_of(256);
    let buffer = gpu.device().create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(stride * height),
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut commands = gpu.device().create_command_encoder(&Default::default());
    commands.copy_texture_to_buffer(
        target.as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: &buffer,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(stride),
                rows_per_image: None,
            },
        },
        wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
    );
    gpu.queue().submit([commands.finish()]);
    buffer.map_async(wgpu::MapMode::Read, .., |mapped| mapped.expect("memory"));
    gpu.device().poll(wgpu::PollType::wait_indefinitely()).expect("an answer");
    let mapped = buffer.get_mapped_range(..).expect("memory");
    mapped.chunks_exact(stride as usize).flat_map(|it| it[..row as usize].to_vec()).collect()
}

/// Every code of each channel of the format at least once, in every neighbourhood.
fn all_codes(color: ColorFormat) -> ColorPlane {
    let mut frame = ColorPlane::new(color, SIZE[0], SIZE[1]);
    let channel = |at: usize, channel: usize| (at * [1, 37, 101][channel] + channel * 301) & 0xffff;
    match &mut frame {
        ColorPlane::Rgba8(plane) => {
            for (at, texel) in plane.data_mut().iter_mut().enumerate() {
                let [red, green, blue] = [0, 1, 2].map(|it| channel(at, it) as u8);
                texel.0 = u32::from_le_bytes([red, green, blue, 255]);
            }
        }
        ColorPlane::Rgb10a2(plane) => {
            for (at, texel) in plane.data_mut().iter_mut().enumerate() {
                let [red, green, blue] = [0, 1, 2].map(|it| channel(at, it) as u32 & 0x3ff);
                texel.0 = red | green << 10 | blue << 20 | 3 << 30;
            }
        }
        ColorPlane::Rgba16f(plane) => {
            for (at, texel) in plane.data_mut().iter_mut().enumerate() {
                // From -0.25 to 2, and what is no number.
                let light = |it| f16::from_f32(channel(at, it) as f32 % 1031.0 / 458.0 - 0.25);
                let light = [0, 1, 2].map(|it| match at {
                    0 => f16::NAN,
                    1 => f16::INFINITY,
                    2 => f16::NEG_INFINITY,
                    _ => light(it),
                });
                let [red, green, blue] = light.map(|light| half_to_ordered(light.to_bits()));
                texel.0 = [red, green, blue, half_to_ordered(0x3c00)];
            }
        }
    }
    frame
}

fn streams() -> Vec<StreamFormat> {
    let formats = [
        (ColorFormat::Rgba8, Transfer::Srgb),
        (ColorFormat::Rgb10a2, Transfer::Srgb),
        (ColorFormat::Rgb10a2, Transfer::Pq),
        (ColorFormat::Rgba16f, Transfer::Linear),
    ];
    let all = [Primaries::Bt709, Primaries::Bt2020, Primaries::DisplayP3];
    let of = |(color, transfer), primaries| {
        let format = StreamFormat::rgba8(SIZE[0], SIZE[1]);
        StreamFormat { color, transfer, primaries, white_cd_m2: 250.0, ..format }
    };
    formats.into_iter().flat_map(|format| all.map(|primaries| of(format, primaries))).collect()
}

fn surface(texture: TextureFormat, encoding: Encoding) -> SurfaceFormat {
    SurfaceFormat { texture, color_space: SurfaceColorSpace::Auto, encoding }
}

/// The largest difference between red, green and blue of a drawn picture and of the CPU's.
fn largest_difference(rgba: &[u8], stream: &StreamFormat, frame: &ColorPlane) -> u8 {
    let mut expected = Vec::new();
    SrgbConverter::new(stream).convert(frame, &mut expected);
    assert_eq!(rgba.len() / 4, expected.len() / 3, "pixels");
    let pairs = rgba.as_chunks::<4>().0.iter().zip(expected.as_chunks::<3>().0);
    let off = pairs.flat_map(|(a, b)| [0, 1, 2].map(|it| a[it].abs_diff(b[it])));
    off.max().expect("pixels")
}

#[test]
fn eight_bits_are_within_one_of_what_the_cpu_makes_of_every_format() {
    let placement = Placement::scaled(SIZE, SIZE);
    for gpu in test_gpus("eight_bits_are_within_one_of_what_the_cpu_makes_of_every_format") {
        for stream in streams() {
            let frame = all_codes(stream.color);
            for (texture, encoding) in [
                (TextureFormat::Rgba8Unorm, Encoding::SrgbCodes),
                (TextureFormat::Rgba8UnormSrgb, Encoding::ClippedLight),
            ] {
                let to = surface(texture, encoding);
                let rgba = drawn(&gpu, &stream, &to, &frame, &placement);
                let off = largest_difference(&rgba, &stream, &frame);
                assert!(off <= 1, "{} {texture:?} {stream:?}: {off}", gpu.name());
                if (stream.transfer, stream.primaries) == (Transfer::Srgb, Primaries::Bt709) {
                    continue;
                }
                // The control: what it is not, drawn as if it were.
                let plain = StreamFormat::rgba8(SIZE[0], SIZE[1]);
                let wrong = StreamFormat { color: stream.color, ..plain };
                let rgba = drawn(&gpu, &wrong, &to, &frame, &placement);
                let off = largest_difference(&rgba, &stream, &frame);
                assert!(off > 1, "{} {texture:?} {stream:?}: no difference", gpu.name());
            }
        }
    }
}

#[test]
fn eight_bit_srgb_goes_over_byte_for_byte_to_its_place_with_black_around_it() {
    let stream = StreamFormat::rgba8(SIZE[0], SIZE[1]);
    let frame = all_codes(stream.color);
    let to = surface(TextureFormat::Bgra8Unorm, Encoding::SrgbCodes);
    for gpu in test_gpus("eight_bit_srgb_goes_over_byte_for_byte_to_its_place") {
        for window in [SIZE, [200, 64], [128, 111], [77, 31], [301, 203]] {
            for placement in [Placement::scaled(SIZE, window), Placement::padded(SIZE, window)] {
                let mut texels = Texels::new(&stream, ByteOrder::Bgrx);
                let picture = texels.picture(&frame, &placement);
                let mut expected = [0, 0, 0, 255].repeat(placement.byte_len() / 4);
                let Rect { x, y, width, height } = placement.picture;
                for row in 0..height {
                    let from = (y + row) as usize * placement.row_len() + x as usize * 4;
                    picture.draw_row(row, &mut expected[from..][..width as usize * 4]);
                }
                let bytes = drawn(&gpu, &stream, &to, &frame, &placement);
                assert!(bytes == expected, "{} {placement:?}", gpu.name());
            }
        }
    }
}

/// Light that a half of a drawn picture stands for, red first, by pixel.
fn light_of(bytes: &[u8]) -> Vec<[f32; 3]> {
    let halves = bytes.as_chunks::<2>().0.iter().map(|it| f16::from_le_bytes(*it).to_f32());
    let halves: Vec<_> = halves.collect();
    halves.as_chunks::<4>().0.iter().map(|it| [it[0], it[1], it[2]]).collect()
}

#[test]
fn light_beyond_white_stays_on_a_surface_that_has_it() {
    let stream = StreamFormat {
        color: ColorFormat::Rgba16f,
        transfer: Transfer::Linear,
        ..StreamFormat::rgba8(SIZE[0], SIZE[1])
    };
    let frame = all_codes(stream.color);
    let ColorPlane::Rgba16f(plane) = &frame else { unreachable!("as it was made") };
    let placement = Placement::scaled(SIZE, SIZE);
    let to = surface(TextureFormat::Rgba16Float, Encoding::Light);
    for gpu in test_gpus("light_beyond_white_stays_on_a_surface_that_has_it") {
        let lights = light_of(&drawn(&gpu, &stream, &to, &frame, &placement));
        assert_eq!(lights[..3], [[0.0; 3], [65_504.0; 3], [-65_504.0; 3]], "{}", gpu.name());
        for (light, texel) in lights.iter().zip(plane.data()).skip(3) {
            let own =
                |it: usize| f16::from_bits(foreframe_engine::color::ordered_to_half(texel.0[it]));
            assert_eq!(*light, [0, 1, 2].map(|it| own(it).to_f32()), "{}", gpu.name());
        }
        assert!(lights.iter().skip(3).any(|light| light[0] > 1.5), "{}", gpu.name());
        // PQ: code 520 stands for 100 cd/m2, and 769 for 1000 (ST 2084).
        let pq = StreamFormat { color: ColorFormat::Rgb10a2, transfer: Transfer::Pq, ..stream };
        let pq = StreamFormat { white_cd_m2: 100.0, ..pq };
        let mut frame = ColorPlane::new(pq.color, SIZE[0], SIZE[1]);
        let word = 520_u32 | 769 << 10;
        for pixel in frame.as_mut_bytes().as_chunks_mut::<4>().0 {
            *pixel = word.to_le_bytes();
        }
        let [red, green, blue] = light_of(&drawn(&gpu, &pq, &to, &frame, &placement))[0];
        assert!((red - 1.0).abs() < 0.01 && (green - 10.0).abs() < 0.1, "{red} {green}");
        assert!(blue.abs() < 1e-3, "{blue}");
    }
}

#[test]
fn pq_codes_of_bt2020_go_over_as_they_are_and_others_keep_white() {
    let placement = Placement::scaled(SIZE, SIZE);
    let to = surface(TextureFormat::Rgb10a2Unorm, Encoding::PqCodes);
    for gpu in test_gpus("pq_codes_of_bt2020_go_over_as_they_are_and_others_keep_white") {
        for primaries in [Primaries::Bt2020, Primaries::Bt709, Primaries::DisplayP3] {
            let stream = StreamFormat {
                color: ColorFormat::Rgb10a2,
                transfer: Transfer::Pq,
                primaries,
                ..StreamFormat::rgba8(SIZE[0], SIZE[1])
            };
            let frame = all_codes(stream.color);
            let codes = drawn(&gpu, &stream, &to, &frame, &placement);
            assert_eq!(codes == frame.as_bytes(), primaries == Primaries::Bt2020, "{primaries:?}");
            let mut grey = ColorPlane::new(stream.color, SIZE[0], SIZE[1]);
            for (at, pixel) in grey.as_mut_bytes().as_chunks_mut::<4>().0.iter_mut().enumerate() {
                let code = at as u32 & 0x3ff;
                *pixel = (code | code << 10 | code << 20 | 3 << 30).to_le_bytes();
            }
            let codes = drawn(&gpu, &stream, &to, &grey, &placement);
            for (a, b) in codes.as_chunks::<4>().0.iter().zip(grey.as_bytes().as_chunks::<4>().0) {
                let [a, b] = [a, b].map(|it| u32::from_le_bytes(*it));
                for shift in [0, 10, 20] {
                    let [a, b] = [a, b].map(|it| it >> shift & 0x3ff);
                    assert!(a.abs_diff(b) <= 1, "{} {primaries:?} {a} {b}", gpu.name());
                }
            }
        }
    }
}

#[test]
fn the_shader_is_valid_and_reads_parameters_of_this_size() {
    let placement = Placement::scaled([3, 2], [7, 9]);
    let stream = StreamFormat { primaries: Primaries::DisplayP3, ..StreamFormat::rgba8(3, 2) };
    let words = params([3, 2], &placement, &stream, Encoding::PqCodes);
    let at = |word: usize| u32::from_le_bytes(words.as_chunks::<4>().0[word]);
    let Rect { x, y, width, height } = placement.picture;
    assert_eq!([at(0), at(1), at(2), at(3), at(4), at(5)], [x, y, width, height, 3, 2]);
    assert_eq!(f32::from_bits(at(6)), 203.0);
    // White is white in any primaries.
    for row in [8, 12, 16] {
        let sum: f32 = (row..row + 3).map(|word| f32::from_bits(at(word))).sum();
        assert!((sum - 1.0).abs() < 1e-4, "{sum}");
        assert_eq!(at(row + 3), 0);
    }
}
