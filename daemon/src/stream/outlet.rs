//! Output frames for one subscriber: slots of a pool that the daemon writes and the subscriber maps
//! read-only.
//!
//! A slot is free, being written, or lent to the subscriber. A subscriber that gives none back
//! loses frames, which are counted; nobody waits for it.

use std::sync::{Mutex, MutexGuard, PoisonError};

use foreframe_engine::color::ordered_to_half;
use foreframe_engine::{ColorPlane, Plane};
use foreframe_protocol::limits::SLOT_ALIGN;
use foreframe_protocol::memory::{SlotMemory, WritablePool};
use foreframe_protocol::{Error, OutputPool, StreamFormat};

/// The writing end of a subscription.
#[derive(Debug)]
pub struct Outlet {
    /// Session of the subscriber.
    pub session: u32,
    /// What the subscriber calls the stream.
    pub stream: u32,
    /// Number of the pool in that session.
    pub pool: u32,
    state: Mutex<State>,
}

#[derive(Debug)]
struct State {
    free: Vec<SlotMemory>,
    lent: Vec<SlotMemory>,
    skipped: u64,
}

/// A slot that was released and not lent.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct NotLent;

/// Bytes of an output pool for frames of this format.
#[must_use]
pub fn pool_bytes(format: &StreamFormat, slots: u32) -> u64 {
    slot_bytes(format).saturating_mul(u64::from(slots))
}

fn slot_bytes(format: &StreamFormat) -> u64 {
    let row = u64::from(format.width) * u64::from(format.color.bytes_per_pixel());
    (row * u64::from(format.height)).next_multiple_of(SLOT_ALIGN)
}

impl Outlet {
    /// Allocates a pool, and the message that goes with its descriptor.
    ///
    /// # Errors
    /// If there is no memory for it.
    pub fn allocate(
        session: u32,
        stream: u32,
        pool: u32,
        slots: u32,
        format: &StreamFormat,
    ) -> Result<(Self, WritablePool, OutputPool), Error> {
        let slot_bytes = slot_bytes(format);
        let (memory, free) = WritablePool::allocate("foreframe-output", slots, slot_bytes)?;
        let message = OutputPool {
            stream,
            pool,
            slots,
            width: format.width,
            height: format.height,
            stride: format.width * format.color.bytes_per_pixel(),
            color: format.color,
            transfer: format.transfer,
            primaries: format.primaries,
            white_cd_m2: format.white_cd_m2,
            slot_bytes,
        };
        let state = Mutex::new(State { free, lent: Vec::new(), skipped: 0 });
        Ok((Self { session, stream, pool, state }, memory, message))
    }

    /// Copies a frame into a free slot and lends it: the slot, and how many frames found none so
    /// far. None if this is one of them.
    #[must_use]
    pub fn write(&self, frame: &ColorPlane) -> Option<(u32, u64)> {
        let taken = {
            let mut state = self.lock();
            let taken = state.free.pop();
            state.skipped += u64::from(taken.is_none());
            taken
        };
        // Outside the lock: the main loop may take slots back meanwhile.
        let mut slot = taken?;
        copy_pixels(frame, &mut slot);
        let index = slot.index();
        let mut state = self.lock();
        state.lent.push(slot);
        Some((index, state.skipped))
    }

    /// The subscriber could not be told of a frame: its slot is free again, and the frame counts as
    /// one that found none.
    pub fn take_back(&self, slot: u32) {
        if self.release(slot).is_ok() {
            self.lock().skipped += 1;
        }
    }

    /// The subscriber gives a slot back.
    ///
    /// # Errors
    /// If it was not lent.
    pub fn release(&self, slot: u32) -> Result<(), NotLent> {
        let mut state = self.lock();
        let position = state.lent.iter().position(|lent| lent.index() == slot).ok_or(NotLent)?;
        let slot = state.lent.swap_remove(position);
        state.free.push(slot);
        Ok(())
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Writes a frame in wire form, without padding. `out` has room for it.
fn copy_pixels(frame: &ColorPlane, out: &mut [u8]) {
    match frame {
        ColorPlane::Rgba8(plane) => copy_texels(plane, out, |texel| texel.0.to_le_bytes()),
        ColorPlane::Rgb10a2(plane) => copy_texels(plane, out, |texel| texel.0.to_le_bytes()),
        ColorPlane::Rgba16f(plane) => copy_texels(plane, out, |texel| {
            let [[r0, r1], [g0, g1], [b0, b1], [a0, a1]] =
                texel.0.map(|ordered| ordered_to_half(ordered).to_le_bytes());
            [r0, r1, g0, g1, b0, b1, a0, a1]
        }),
    }
}

fn copy_texels<T: Copy, const N: usize>(
    plane: &Plane<T>,
    out: &mut [u8],
    bytes: impl Fn(T) -> [u8; N],
) {
    let (pixels, _) = out.as_chunks_mut::<N>();
    for (pixel, &texel) in pixels.iter_mut().zip(plane.data()) {
        *pixel = bytes(texel);
    }
}

#[cfg(test)]
mod tests {
    use foreframe_engine::color::ColorFormat;
    use foreframe_engine::color::{OrderedRgba16, Rgba8, half_to_ordered};

    use super::*;

    fn outlet(slots: u32) -> Outlet {
        Outlet::allocate(1, 0, 1, slots, &StreamFormat::rgba8(3, 2)).unwrap().0
    }

    fn frame() -> ColorPlane {
        ColorPlane::new(ColorFormat::Rgba8, 3, 2)
    }

    #[test]
    fn a_subscriber_that_gives_nothing_back_loses_frames_and_nobody_waits() {
        let outlet = outlet(2);
        assert!(outlet.write(&frame()).is_some());
        let (last, skipped) = outlet.write(&frame()).unwrap();
        assert_eq!(skipped, 0);
        assert_eq!(outlet.write(&frame()), None);
        assert_eq!(outlet.write(&frame()), None);
        outlet.release(last).unwrap();
        assert_eq!(outlet.write(&frame()), Some((last, 2)));
    }

    #[test]
    fn only_a_lent_slot_can_be_given_back_and_only_once() {
        let outlet = outlet(2);
        assert_eq!(outlet.release(0), Err(NotLent));
        let (slot, _) = outlet.write(&frame()).unwrap();
        assert_eq!(outlet.release(slot + 2), Err(NotLent));
        outlet.release(slot).unwrap();
        assert_eq!(outlet.release(slot), Err(NotLent));
    }

    #[test]
    fn pixels_are_written_in_wire_form() {
        let mut out = [0xaa; 20];
        let texels = vec![Rgba8(0x0403_0201), Rgba8(0x0807_0605)];
        copy_pixels(&ColorPlane::Rgba8(Plane::from_vec(2, 1, texels)), &mut out);
        assert_eq!(out[..9], [1, 2, 3, 4, 5, 6, 7, 8, 0xaa]);
        let texels = vec![OrderedRgba16([0x3c00, 0xbc00, 0, 1].map(half_to_ordered))];
        copy_pixels(&ColorPlane::Rgba16f(Plane::from_vec(1, 1, texels)), &mut out);
        assert_eq!(out[..9], [0, 0x3c, 0, 0xbc, 0, 0, 1, 0, 0xaa]);
    }
}
