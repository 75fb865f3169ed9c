//! How a surface presents, and in which format: pure functions of what it offers.
//!
//! Present mode. Frames are paced by us and handed over once per refresh, so that a mode has one
//! thing to do: take a frame without waiting, and show it whole.
//! - Mailbox does that; the one queued frame is replaced. With a variable refresh rate it is shown
//!   when it comes.
//! - Fifo shows every frame and may wait in the middle of a call, for ever where nobody sees the
//!   window, with the device's queue locked, which the engine needs. So a frame is handed over
//!   only when the compositor has asked for one ([`Waits::AtTheGate`]); without such word, as on
//!   X11, drivers wait for a refresh at most, seen or not.
//! - Immediate and relaxed Fifo show parts of two frames at once. Nobody has asked for that.
//!
//! Format. What a stream has is shown as it is where the surface can say so: more than 8 bits, or
//! light beyond white. Else it is clipped at the stream's white, as for other sinks
//! ([`crate::sink::srgb`]).

use foreframe_engine::StreamFormat;
use foreframe_engine::color::ColorFormat;
use foreframe_engine::format::Transfer;
use wgpu::{PresentMode, SurfaceColorSpace, SurfaceFormatCapabilities, TextureFormat};

/// What handing over a frame may wait for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Waits {
    /// Nothing.
    Never,
    /// Nothing, if the compositor has asked for it.
    AtTheGate,
    /// A refresh.
    ForTheDisplay,
}

/// The mode for a surface that offers these, and what it waits for; None if all tear. `asks`: the
/// compositor says when it wants a frame.
pub(super) fn present_mode(offered: &[PresentMode], asks: bool) -> Option<(PresentMode, Waits)> {
    let modes = [
        (PresentMode::Mailbox, Waits::Never),
        (PresentMode::Fifo, if asks { Waits::AtTheGate } else { Waits::ForTheDisplay }),
    ];
    modes.into_iter().find(|(mode, _)| offered.contains(mode))
}

/// What the numbers in a texel of a surface stand for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Encoding {
    /// sRGB codes, BT.709, clipped at the stream's white.
    SrgbCodes,
    /// The light that those stand for: the surface encodes it.
    ClippedLight,
    /// Light, 1 at the stream's white, BT.709; above 1 is brighter, below 0 another colour.
    Light,
    /// PQ codes, BT.2020.
    PqCodes,
}

/// Format of a surface.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct SurfaceFormat {
    pub(super) texture: TextureFormat,
    pub(super) color_space: SurfaceColorSpace,
    pub(super) encoding: Encoding,
}

const fn format(
    texture: TextureFormat,
    color_space: SurfaceColorSpace,
    encoding: Encoding,
) -> SurfaceFormat {
    SurfaceFormat { texture, color_space, encoding }
}

const PQ: SurfaceFormat =
    format(TextureFormat::Rgb10a2Unorm, SurfaceColorSpace::Bt2100Pq, Encoding::PqCodes);
const EXTENDED: SurfaceFormat =
    format(TextureFormat::Rgba16Float, SurfaceColorSpace::ExtendedSrgbLinear, Encoding::Light);
const TEN_BITS: SurfaceFormat =
    format(TextureFormat::Rgb10a2Unorm, SurfaceColorSpace::Srgb, Encoding::SrgbCodes);
/// In this order: what is encoded by us is the same on every adapter.
const EIGHT_BITS: [SurfaceFormat; 4] = [
    format(TextureFormat::Bgra8Unorm, SurfaceColorSpace::Srgb, Encoding::SrgbCodes),
    format(TextureFormat::Rgba8Unorm, SurfaceColorSpace::Srgb, Encoding::SrgbCodes),
    format(TextureFormat::Bgra8UnormSrgb, SurfaceColorSpace::Srgb, Encoding::ClippedLight),
    format(TextureFormat::Rgba8UnormSrgb, SurfaceColorSpace::Srgb, Encoding::ClippedLight),
];

/// The format for pictures of `stream` on a surface that offers these; None if there is none.
pub(super) fn surface_format(
    offered: &[SurfaceFormatCapabilities],
    stream: &StreamFormat,
) -> Option<SurfaceFormat> {
    let own: &[SurfaceFormat] = match (stream.color, stream.transfer) {
        (_, Transfer::Pq) => &[PQ, EXTENDED, TEN_BITS],
        (_, Transfer::Linear) => &[EXTENDED, TEN_BITS],
        (ColorFormat::Rgb10a2 | ColorFormat::Rgba16f, Transfer::Srgb) => &[TEN_BITS],
        (ColorFormat::Rgba8, Transfer::Srgb) => &[],
    };
    // A display of more bits shows fewer, too.
    let wanted = own.iter().chain(&EIGHT_BITS).chain(&[TEN_BITS, EXTENDED]);
    let is_offered = |it: &&SurfaceFormat| {
        let space = it.color_space.to_color_spaces();
        offered.iter().any(|one| {
            one.format == it.texture && space.is_some_and(|it| one.color_spaces.contains(it))
        })
    };
    wanted.into_iter().find(is_offered).copied()
}

#[cfg(test)]
mod tests {
    use wgpu::SurfaceColorSpaces;

    use super::*;

    #[test]
    fn a_mode_takes_frames_without_waiting_and_never_tears() {
        use PresentMode::{Fifo, FifoRelaxed, Immediate, Mailbox};
        use Waits::{AtTheGate, ForTheDisplay, Never};
        let cases = [
            // Mesa on Wayland, and the same with tearing control.
            (&[Mailbox, Fifo][..], true, Some((Mailbox, Never))),
            (&[Immediate, Mailbox, Fifo], true, Some((Mailbox, Never))),
            // Mesa on X11.
            (&[Immediate, Mailbox, Fifo, FifoRelaxed], false, Some((Mailbox, Never))),
            // Drivers that queue every frame.
            (&[Fifo], true, Some((Fifo, AtTheGate))),
            (&[Fifo, FifoRelaxed], true, Some((Fifo, AtTheGate))),
            (&[Immediate, Fifo, FifoRelaxed], false, Some((Fifo, ForTheDisplay))),
            // Nothing but what tears.
            (&[Immediate], true, None),
            (&[FifoRelaxed, Immediate], false, None),
            (&[], true, None),
        ];
        for (offered, asks, expected) in cases {
            assert_eq!(present_mode(offered, asks), expected, "{offered:?} {asks}");
        }
    }

    #[test]
    fn a_format_shows_what_the_stream_has_where_the_surface_can() {
        use ColorFormat::{Rgb10a2, Rgba8, Rgba16f};
        use TextureFormat as T;
        const SRGB: SurfaceColorSpaces = SurfaceColorSpaces::SRGB;
        const SCRGB: SurfaceColorSpaces = SurfaceColorSpaces::EXTENDED_SRGB_LINEAR;
        const PQ_TOO: SurfaceColorSpaces = SRGB.union(SurfaceColorSpaces::BT2100_PQ);
        let plain = &[(T::Bgra8UnormSrgb, SRGB), (T::Bgra8Unorm, SRGB)][..];
        let hdr = &[
            (T::Rgba8Unorm, SRGB),
            (T::Rgb10a2Unorm, PQ_TOO),
            (T::Rgba16Float, SCRGB.union(SRGB)),
        ][..];
        let deep = &[(T::Rgba8Unorm, SRGB), (T::Rgb10a2Unorm, SRGB), (T::Rgba16Float, SRGB)][..];
        let encoding = &[(T::Rgba8UnormSrgb, SRGB)][..];
        let narrow = &[(T::Rgb10a2Unorm, SRGB)][..];
        let pq_alone = &[(T::Rgb10a2Unorm, SurfaceColorSpaces::BT2100_PQ)][..];
        let codes = |texture| Some(format(texture, SurfaceColorSpace::Srgb, Encoding::SrgbCodes));
        let cases = [
            (Rgba8, Transfer::Srgb, plain, codes(T::Bgra8Unorm)),
            (Rgba8, Transfer::Srgb, hdr, codes(T::Rgba8Unorm)),
            (Rgba8, Transfer::Srgb, encoding, Some(EIGHT_BITS[3])),
            (Rgba8, Transfer::Srgb, narrow, Some(TEN_BITS)),
            (Rgba8, Transfer::Srgb, pq_alone, None),
            (Rgba8, Transfer::Srgb, &[], None),
            (Rgb10a2, Transfer::Srgb, plain, codes(T::Bgra8Unorm)),
            (Rgb10a2, Transfer::Srgb, hdr, Some(TEN_BITS)),
            (Rgb10a2, Transfer::Pq, plain, codes(T::Bgra8Unorm)),
            (Rgb10a2, Transfer::Pq, deep, Some(TEN_BITS)),
            (Rgb10a2, Transfer::Pq, hdr, Some(PQ)),
            (Rgb10a2, Transfer::Pq, pq_alone, Some(PQ)),
            (Rgba16f, Transfer::Linear, plain, codes(T::Bgra8Unorm)),
            (Rgba16f, Transfer::Linear, hdr, Some(EXTENDED)),
            // Half floats without a word of what they stand for are no light.
            (Rgba16f, Transfer::Linear, deep, Some(TEN_BITS)),
            (Rgba16f, Transfer::Srgb, hdr, Some(TEN_BITS)),
        ];
        for (color, transfer, offered, expected) in cases {
            let stream = StreamFormat { color, transfer, ..StreamFormat::rgba8(1, 1) };
            let offered: Vec<_> = offered
                .iter()
                .map(|&(format, color_spaces)| SurfaceFormatCapabilities { format, color_spaces })
                .collect();
            let chosen = surface_format(&offered, &stream);
            assert_eq!(chosen, expected, "{color:?} {transfer:?} {offered:?}");
        }
    }
}
