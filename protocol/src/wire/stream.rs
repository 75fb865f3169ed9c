//! Streams: one sequence of key frames with one format. The client numbers its streams.

use zerocopy::little_endian::{F32, U32};

use super::Wire;
use super::check::{Check, floats, raw_floats};
use super::session::EndReason;
use crate::error::Result;
use crate::format::{ColorFormat, DepthConvention, MaskFormat, MotionConvention, StreamFormat};
use crate::limits::{MAX_PLANE_RATIO, MAX_SIZE, MAX_SLOTS, MIN_SLOTS};
use crate::message::{MessageKind, put_extension};
use crate::plane::{PlaneKind, PlaneMap, PlaneSize};
use crate::profile::ProfileName;

wire_struct! {
    /// See [`PlaneSize`].
    PlaneSizeRaw, 8 {
        0 width: U32,
        4 height: U32,
    }
}

wire_struct! {
    /// See [`CreateStream`].
    CreateStreamRaw, 120 {
        0 stream: U32,
        4 width: U32,
        8 height: U32,
        12 color_format: U32,
        16 transfer: U32,
        20 primaries: U32,
        24 white_cd_m2: F32,
        28 valid_rect_use: U32,
        32 depth_format: U32,
        36 depth_meaning: U32,
        40 motion_format: U32,
        44 motion_direction: U32,
        48 motion_unit: U32,
        52 camera_motion: U32,
        56 motion_scale: [F32; 2],
        64 ui_format: U32,
        68 mask_format: U32,
        72 slots: U32,
        76 reserved: U32,
        80 max_sizes: [PlaneSizeRaw; 5],
    }
}

wire_struct! {
    /// See [`StreamCreated`].
    StreamCreatedRaw, 8 {
        0 stream: U32,
        4 slots: U32,
    }
}

wire_struct! {
    /// See [`DestroyStream`].
    DestroyStreamRaw, 8 {
        0 stream: U32,
        4 reserved: U32,
    }
}

wire_struct! {
    /// See [`StreamEnded`].
    StreamEndedRaw, 8 {
        0 stream: U32,
        4 reason: U32,
    }
}

/// Tag of the extension of [`CreateStream`] that names a display profile. Not critical: a daemon
/// that does not know it shows the stream as on its own display.
pub const DISPLAY_PROFILE_TAG: u16 = 1;

/// A new stream.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CreateStream {
    /// Number of the stream, above every number that this session has used, and not 0.
    pub stream: u32,
    /// What stays the same for all its key frames.
    pub format: StreamFormat,
    /// Largest size of each plane that the format declares. Colour's is the size of the stream.
    pub max_sizes: PlaneMap<PlaneSize>,
    /// Slots, 1 to 8.
    pub slots: u32,
}

/// The stream exists. Its pool may already be on the way.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct StreamCreated {
    /// The client's number.
    pub stream: u32,
    /// Slots, as asked for.
    pub slots: u32,
}

/// No more key frames will come.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct DestroyStream {
    /// The client's number.
    pub stream: u32,
}

/// The stream is gone, its pool is no longer read, its number stays used.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct StreamEnded {
    /// The client's number.
    pub stream: u32,
    /// Why.
    pub reason: EndReason,
}

fn stream_id(check: Check, id: U32) -> Result<u32> {
    check.range("stream", u64::from(id.get()), 1, u64::from(u32::MAX))?;
    Ok(id.get())
}

fn depth(check: Check, raw: &CreateStreamRaw) -> Result<Option<DepthConvention>> {
    if raw.depth_format == 0 {
        check.zero("depth_meaning", &raw.depth_meaning)?;
        return Ok(None);
    }
    Ok(Some(DepthConvention {
        format: check.coded("depth_format", raw.depth_format)?,
        meaning: check.coded("depth_meaning", raw.depth_meaning)?,
    }))
}

fn motion(check: Check, raw: &CreateStreamRaw) -> Result<Option<MotionConvention>> {
    if raw.motion_format == 0 {
        check.zero("motion_direction", &raw.motion_direction)?;
        check.zero("motion_unit", &raw.motion_unit)?;
        check.zero("camera_motion", &raw.camera_motion)?;
        check.zero("motion_scale", &raw.motion_scale)?;
        return Ok(None);
    }
    Ok(Some(MotionConvention {
        format: check.coded("motion_format", raw.motion_format)?,
        direction: check.coded("motion_direction", raw.motion_direction)?,
        unit: check.coded("motion_unit", raw.motion_unit)?,
        scale: floats(&raw.motion_scale),
        camera_motion: check.coded("camera_motion", raw.camera_motion)?,
    }))
}

fn max_sizes(
    check: Check,
    format: &StreamFormat,
    raw: &[PlaneSizeRaw; PlaneKind::COUNT],
) -> Result<PlaneMap<PlaneSize>> {
    let mut sizes = raw.iter();
    PlaneMap::try_from_fn(|kind| {
        let raw = sizes.next().expect("one per kind");
        if format.bytes_per_pixel(kind).is_none() {
            check.zero("max_sizes", raw)?;
            return Ok(None);
        }
        let size = PlaneSize { width: raw.width.get(), height: raw.height.get() };
        let full = PlaneSize { width: format.width, height: format.height };
        let least = |full: u32| (full / MAX_PLANE_RATIO).max(1);
        let is_allowed = match kind {
            PlaneKind::Color => size == full,
            PlaneKind::Ui => {
                (1..=MAX_SIZE).contains(&size.width) && (1..=MAX_SIZE).contains(&size.height)
            }
            _ => {
                (least(full.width)..=full.width).contains(&size.width)
                    && (least(full.height)..=full.height).contains(&size.height)
            }
        };
        if !is_allowed {
            let expected = match kind {
                PlaneKind::Color => format!("{full} for color, the size of the stream"),
                PlaneKind::Ui => format!("1x1 to {MAX_SIZE}x{MAX_SIZE} for ui"),
                _ => format!("1/{MAX_PLANE_RATIO} to 1/1 of {full} per axis for {kind}"),
            };
            return check.fail("max_sizes", expected, size);
        }
        Ok(Some(size))
    })
}

impl Wire for CreateStream {
    type Raw = CreateStreamRaw;
    const KIND: MessageKind = MessageKind::CreateStream;

    fn to_raw(&self) -> CreateStreamRaw {
        let Self { format, max_sizes, .. } = self;
        let code = |code: Option<u32>| U32::new(code.unwrap_or(0));
        let motion = format.motion;
        CreateStreamRaw {
            stream: U32::new(self.stream),
            width: U32::new(format.width),
            height: U32::new(format.height),
            color_format: U32::new(format.color.code()),
            transfer: U32::new(format.transfer.code()),
            primaries: U32::new(format.primaries.code()),
            white_cd_m2: F32::new(format.white_cd_m2),
            valid_rect_use: U32::new(format.valid_rect_use.code()),
            depth_format: code(format.depth.map(|depth| depth.format.code())),
            depth_meaning: code(format.depth.map(|depth| depth.meaning.code())),
            motion_format: code(motion.map(|motion| motion.format.code())),
            motion_direction: code(motion.map(|motion| motion.direction.code())),
            motion_unit: code(motion.map(|motion| motion.unit.code())),
            camera_motion: code(motion.map(|motion| motion.camera_motion.code())),
            motion_scale: raw_floats(&motion.map_or([0.0; 2], |motion| motion.scale)),
            ui_format: code(format.ui.map(ColorFormat::code)),
            mask_format: code(format.mask.map(MaskFormat::code)),
            slots: U32::new(self.slots),
            reserved: U32::ZERO,
            max_sizes: std::array::from_fn(|index| {
                let size = max_sizes.get(PlaneKind::ALL[index]);
                let (width, height) = size.map_or((0, 0), |size| (size.width, size.height));
                PlaneSizeRaw { width: U32::new(width), height: U32::new(height) }
            }),
        }
    }

    fn from_raw(raw: &CreateStreamRaw) -> Result<Self> {
        let check = Check(Self::KIND);
        check.zero("reserved", &raw.reserved)?;
        let format = StreamFormat {
            width: raw.width.get(),
            height: raw.height.get(),
            color: check.coded("color_format", raw.color_format)?,
            transfer: check.coded("transfer", raw.transfer)?,
            primaries: check.coded("primaries", raw.primaries)?,
            white_cd_m2: raw.white_cd_m2.get(),
            valid_rect_use: check.coded("valid_rect_use", raw.valid_rect_use)?,
            depth: depth(check, raw)?,
            motion: motion(check, raw)?,
            ui: match raw.ui_format {
                none if none == 0 => None,
                code => Some(check.coded("ui_format", code)?),
            },
            mask: match raw.mask_format {
                none if none == 0 => None,
                code => Some(check.coded("mask_format", code)?),
            },
            display_profile: None,
        };
        if let Some((field, expected, found)) = format.first_fault() {
            return check.fail(field, expected, found);
        }
        let slots = raw.slots.get();
        check.range("slots", u64::from(slots), u64::from(MIN_SLOTS), u64::from(MAX_SLOTS))?;
        Ok(Self {
            stream: stream_id(check, raw.stream)?,
            format,
            max_sizes: max_sizes(check, &format, &raw.max_sizes)?,
            slots,
        })
    }

    fn put_extensions(&self, bytes: &mut Vec<u8>) {
        if let Some(name) = &self.format.display_profile {
            put_extension(DISPLAY_PROFILE_TAG, name.as_str().as_bytes(), bytes);
        }
    }

    fn take_extension(&mut self, tag: u16, data: &[u8]) -> Result<bool> {
        if tag != DISPLAY_PROFILE_TAG {
            return Ok(false);
        }
        if let Some(first) = self.format.display_profile {
            let found = format!("another after {first}");
            return Check(Self::KIND).fail(ProfileName::FIELD, "one name", found);
        }
        self.format.display_profile = Some(ProfileName::from_bytes(data)?);
        Ok(true)
    }
}

impl Wire for StreamCreated {
    type Raw = StreamCreatedRaw;
    const KIND: MessageKind = MessageKind::StreamCreated;

    fn to_raw(&self) -> StreamCreatedRaw {
        StreamCreatedRaw { stream: U32::new(self.stream), slots: U32::new(self.slots) }
    }

    fn from_raw(raw: &StreamCreatedRaw) -> Result<Self> {
        let check = Check(Self::KIND);
        let slots = u64::from(raw.slots.get());
        check.range("slots", slots, u64::from(MIN_SLOTS), u64::from(MAX_SLOTS))?;
        Ok(Self { stream: stream_id(check, raw.stream)?, slots: raw.slots.get() })
    }
}

impl Wire for DestroyStream {
    type Raw = DestroyStreamRaw;
    const KIND: MessageKind = MessageKind::DestroyStream;

    fn to_raw(&self) -> DestroyStreamRaw {
        DestroyStreamRaw { stream: U32::new(self.stream), reserved: U32::ZERO }
    }

    fn from_raw(raw: &DestroyStreamRaw) -> Result<Self> {
        let check = Check(Self::KIND);
        check.zero("reserved", &raw.reserved)?;
        Ok(Self { stream: stream_id(check, raw.stream)? })
    }
}

impl Wire for StreamEnded {
    type Raw = StreamEndedRaw;
    const KIND: MessageKind = MessageKind::StreamEnded;

    fn to_raw(&self) -> StreamEndedRaw {
        StreamEndedRaw { stream: U32::new(self.stream), reason: U32::new(self.reason.code()) }
    }

    fn from_raw(raw: &StreamEndedRaw) -> Result<Self> {
        let check = Check(Self::KIND);
        Ok(Self {
            stream: stream_id(check, raw.stream)?,
            reason: check.coded("reason", raw.reason)?,
        })
    }
}
