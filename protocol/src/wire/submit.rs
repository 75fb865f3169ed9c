//! One key frame, and the return of its slot. The body of a submit is also the record that a
//! capture keeps of a key frame.

use zerocopy::little_endian::{F32, U32, U64};

use super::Wire;
use super::camera::{Camera, matrix};
use super::check::{Check, floats, raw_floats};
use super::stream::CreateStream;
use crate::error::{Error, Result};
use crate::limits::MAX_SLOTS;
use crate::message::MessageKind;
use crate::plane::{PlaneDescriptor, PlaneKind, PlaneMap, Rect};

wire_struct! {
    /// See [`PlaneDescriptor`].
    PlaneRaw, 48 {
        0 offset: U64,
        8 width: U32,
        12 height: U32,
        16 stride: U32,
        20 reserved: U32,
        24 valid_x: U32,
        28 valid_y: U32,
        32 valid_width: U32,
        36 valid_height: U32,
        40 jitter: [F32; 2],
    }
}

wire_struct! {
    /// See [`Submit`].
    SubmitRaw, 536 {
        0 stream: U32,
        4 slot: U32,
        8 key_index: U64,
        16 content_time_ns: U64,
        24 motion_from_ns: U64,
        32 flags: U32,
        36 plane_bits: U32,
        40 planes: [PlaneRaw; 5],
        280 view: [F32; 16],
        344 projection: [F32; 16],
        408 motion_from_view: [F32; 16],
        472 motion_from_projection: [F32; 16],
    }
}

/// `flags`: nothing before this key relates to it.
const IS_CUT: u32 = 1;
/// `flags`: `motion_from_ns` holds a time.
const HAS_MOTION_FROM: u32 = 1 << 1;
/// `flags`: `view` and `projection` hold matrices.
const HAS_CAMERA: u32 = 1 << 2;
/// `flags`: `motion_from_view` and `motion_from_projection` hold matrices.
const HAS_MOTION_FROM_CAMERA: u32 = 1 << 3;
const KNOWN_FLAGS: u32 = IS_CUT | HAS_MOTION_FROM | HAS_CAMERA | HAS_MOTION_FROM_CAMERA;

/// A key frame lies in a slot, complete.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Submit {
    /// The client's number of the stream.
    pub stream: u32,
    /// The slot, 0 to 7.
    pub slot: u32,
    /// Sequence number that the application counts up.
    pub key_index: u64,
    /// Simulation time that the picture shows.
    pub content_time_ns: u64,
    /// Content time that the motion plane points back to, whether or not that frame was submitted.
    pub motion_from_ns: Option<u64>,
    /// The application says that nothing before this key relates to it.
    pub is_cut: bool,
    /// Where each plane lies. Colour is always there.
    pub planes: PlaneMap<PlaneDescriptor>,
    /// Camera at `content_time_ns`.
    pub camera: Option<Camera>,
    /// Camera at `motion_from_ns`; needed where vectors lack the camera's motion.
    pub motion_from_camera: Option<Camera>,
}

impl Submit {
    /// Checks what needs the stream: that it has these planes, that each fits what was declared
    /// and the slot, and that no two share a byte.
    ///
    /// # Errors
    /// The first fault, with what was expected and found.
    pub fn check(&self, stream: &CreateStream, slot_bytes: u64) -> Result<()> {
        let check = Check(MessageKind::Submit);
        let last_slot = u64::from(stream.slots) - 1;
        check.range("slot", u64::from(self.slot), 0, last_slot)?;
        let format = &stream.format;
        let Some(color) = self.planes.get(PlaneKind::Color).map(PlaneDescriptor::size) else {
            return check.fail("plane_bits", "a color plane", "none");
        };
        if (color.width, color.height) != (format.width, format.height) {
            return Err(Error::Plane {
                plane: PlaneKind::Color,
                field: "size",
                expected: format!("{}x{}, the size of the stream", format.width, format.height),
                found: color.to_string(),
            });
        }
        let mut used: Vec<(u64, u64, PlaneKind)> = Vec::with_capacity(PlaneKind::COUNT);
        for (kind, plane) in self.planes.iter() {
            let (Some(bytes_per_pixel), Some(&max_size)) =
                (format.bytes_per_pixel(kind), stream.max_sizes.get(kind))
            else {
                let declared: Vec<&str> =
                    stream.max_sizes.iter().map(|(kind, _)| kind.name()).collect();
                return check.fail("plane_bits", declared.join(", "), kind);
            };
            plane.check(kind, bytes_per_pixel, max_size, color, slot_bytes)?;
            used.push((plane.offset, plane.offset + plane.byte_len(bytes_per_pixel), kind));
        }
        used.sort_unstable_by_key(|&(start, ..)| start);
        for pair in used.windows(2) {
            let ((_, end, before), (start, _, after)) = (pair[0], pair[1]);
            if start < end {
                return Err(Error::Plane {
                    plane: after,
                    field: "offset",
                    expected: format!("at least {end}, the end of the {before} plane"),
                    found: start.to_string(),
                });
            }
        }
        Ok(())
    }
}

pub(super) fn plane_raw(plane: Option<&PlaneDescriptor>) -> PlaneRaw {
    let Some(plane) = plane else { return zerocopy::FromZeros::new_zeroed() };
    PlaneRaw {
        offset: U64::new(plane.offset),
        width: U32::new(plane.width),
        height: U32::new(plane.height),
        stride: U32::new(plane.stride),
        reserved: U32::ZERO,
        valid_x: U32::new(plane.valid.x),
        valid_y: U32::new(plane.valid.y),
        valid_width: U32::new(plane.valid.width),
        valid_height: U32::new(plane.valid.height),
        jitter: raw_floats(&plane.jitter),
    }
}

pub(super) fn plane(check: Check, kind: PlaneKind, raw: &PlaneRaw) -> Result<PlaneDescriptor> {
    check.zero("planes.reserved", &raw.reserved)?;
    let plane = PlaneDescriptor {
        offset: raw.offset.get(),
        width: raw.width.get(),
        height: raw.height.get(),
        stride: raw.stride.get(),
        valid: Rect {
            x: raw.valid_x.get(),
            y: raw.valid_y.get(),
            width: raw.valid_width.get(),
            height: raw.valid_height.get(),
        },
        jitter: floats(&raw.jitter),
    };
    match plane.first_fault() {
        None => Ok(plane),
        Some((field, expected, found)) => Err(Error::Plane { plane: kind, field, expected, found }),
    }
}

fn camera_raw(camera: Option<Camera>) -> ([F32; 16], [F32; 16]) {
    let absent = Camera { view: [0.0; 16], projection: [0.0; 16] };
    let camera = camera.unwrap_or(absent);
    (raw_floats(&camera.view), raw_floats(&camera.projection))
}

impl Wire for Submit {
    type Raw = SubmitRaw;
    const KIND: MessageKind = MessageKind::Submit;

    fn to_raw(&self) -> SubmitRaw {
        let flag = |is_set: bool, bit: u32| if is_set { bit } else { 0 };
        let flags = flag(self.is_cut, IS_CUT)
            | flag(self.motion_from_ns.is_some(), HAS_MOTION_FROM)
            | flag(self.camera.is_some(), HAS_CAMERA)
            | flag(self.motion_from_camera.is_some(), HAS_MOTION_FROM_CAMERA);
        let (view, projection) = camera_raw(self.camera);
        let (motion_from_view, motion_from_projection) = camera_raw(self.motion_from_camera);
        SubmitRaw {
            stream: U32::new(self.stream),
            slot: U32::new(self.slot),
            key_index: U64::new(self.key_index),
            content_time_ns: U64::new(self.content_time_ns),
            motion_from_ns: U64::new(self.motion_from_ns.unwrap_or(0)),
            flags: U32::new(flags),
            plane_bits: U32::new(self.planes.bits()),
            planes: std::array::from_fn(|index| plane_raw(self.planes.get(PlaneKind::ALL[index]))),
            view,
            projection,
            motion_from_view,
            motion_from_projection,
        }
    }

    fn from_raw(raw: &SubmitRaw) -> Result<Self> {
        let check = Check(Self::KIND);
        check.range("stream", u64::from(raw.stream.get()), 1, u64::from(u32::MAX))?;
        check.range("slot", u64::from(raw.slot.get()), 0, u64::from(MAX_SLOTS) - 1)?;
        let content_time_ns = check.time("content_time_ns", raw.content_time_ns.get())?;
        let flags = check.flags("flags", raw.flags, KNOWN_FLAGS)?;

        let motion_from_ns = if flags & HAS_MOTION_FROM == 0 {
            check.zero("motion_from_ns", &raw.motion_from_ns)?;
            None
        } else {
            let motion_from_ns = raw.motion_from_ns.get();
            if motion_from_ns >= content_time_ns {
                let expected = format!("before content_time_ns {content_time_ns}");
                return check.fail("motion_from_ns", expected, motion_from_ns);
            }
            Some(motion_from_ns)
        };

        let all_planes = (1 << PlaneKind::COUNT) - 1;
        let plane_bits = check.flags("plane_bits", raw.plane_bits, all_planes)?;
        if plane_bits & PlaneKind::Color.bit() == 0 {
            return check.fail("plane_bits", "a color plane", format!("{plane_bits:#x}"));
        }
        let mut raw_planes = raw.planes.iter();
        let planes = PlaneMap::try_from_fn(|kind| {
            let raw = raw_planes.next().expect("one per kind");
            if plane_bits & kind.bit() == 0 {
                return check.zero("planes", raw).map(|()| None);
            }
            plane(check, kind, raw).map(Some)
        })?;

        let camera = |flag: u32, names: [&'static str; 2], raw: [&[F32; 16]; 2]| {
            if flags & flag == 0 {
                check.zero(names[0], raw[0])?;
                check.zero(names[1], raw[1])?;
                return Ok(None);
            }
            Ok(Some(Camera {
                view: matrix(check, names[0], raw[0])?,
                projection: matrix(check, names[1], raw[1])?,
            }))
        };
        Ok(Self {
            stream: raw.stream.get(),
            slot: raw.slot.get(),
            key_index: raw.key_index.get(),
            content_time_ns,
            motion_from_ns,
            is_cut: flags & IS_CUT != 0,
            planes,
            camera: camera(HAS_CAMERA, ["view", "projection"], [&raw.view, &raw.projection])?,
            motion_from_camera: camera(
                HAS_MOTION_FROM_CAMERA,
                ["motion_from_view", "motion_from_projection"],
                [&raw.motion_from_view, &raw.motion_from_projection],
            )?,
        })
    }
}

wire_enum! {
    /// Why a slot belongs to the client again.
    ReleaseReason {
        /// Its planes were copied; the key frame is in use.
        Copied = 1 "copied",
        /// A newer key frame came before this one was latched.
        Superseded = 2 "superseded",
        /// Its planes do not fit the stream; an error message says how.
        Refused = 3 "refused",
        /// The stream ends.
        StreamEnded = 4 "stream_ended",
    }
}

wire_struct! {
    /// See [`SlotReleased`].
    SlotReleasedRaw, 24 {
        0 stream: U32,
        4 slot: U32,
        8 key_index: U64,
        16 reason: U32,
        20 reserved: U32,
    }
}

/// The slot belongs to the client again.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SlotReleased {
    /// The client's number of the stream.
    pub stream: u32,
    /// The slot.
    pub slot: u32,
    /// The key frame that was in it, or `ui_index` of the UI plane.
    pub key_index: u64,
    /// What became of it.
    pub reason: ReleaseReason,
}

impl Wire for SlotReleased {
    type Raw = SlotReleasedRaw;
    const KIND: MessageKind = MessageKind::SlotReleased;

    fn to_raw(&self) -> SlotReleasedRaw {
        SlotReleasedRaw {
            stream: U32::new(self.stream),
            slot: U32::new(self.slot),
            key_index: U64::new(self.key_index),
            reason: U32::new(self.reason.code()),
            reserved: U32::ZERO,
        }
    }

    fn from_raw(raw: &SlotReleasedRaw) -> Result<Self> {
        let check = Check(Self::KIND);
        check.zero("reserved", &raw.reserved)?;
        check.range("slot", u64::from(raw.slot.get()), 0, u64::from(MAX_SLOTS) - 1)?;
        Ok(Self {
            stream: raw.stream.get(),
            slot: raw.slot.get(),
            key_index: raw.key_index.get(),
            reason: check.coded("reason", raw.reason)?,
        })
    }
}
