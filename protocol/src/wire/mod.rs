//! The messages: layout (`...Raw`), typed value, and the one `parse` between the two.
//!
//! A raw struct is `repr(C)`, little-endian, made of fixed-width integers and floats, with every
//! padding byte named; `wire_struct!` asserts size, alignment and each offset at compile time and
//! lists them for the test that reads `PROTOCOL.md`. An absent optional part is all zero bytes, so
//! each value has exactly one encoding.

pub mod camera;
pub(crate) mod check;
pub mod feedback;
pub mod handshake;
pub mod output;
pub mod pool;
pub mod reject;
pub mod session;
pub mod stream;
pub mod submit;
pub mod ui;

use crate::error::Result;
use crate::layout::{EnumLayout, RawLayout, StructLayout};
use crate::message::MessageKind;

/// A message body that has a raw layout.
pub(crate) trait Wire: Sized {
    /// What stands in the packet.
    type Raw: RawLayout;
    /// Type of the message.
    const KIND: MessageKind;
    /// The only encoding of this value.
    fn to_raw(&self) -> Self::Raw;
    /// Checks every field.
    fn from_raw(raw: &Self::Raw) -> Result<Self>;
    /// Appends the extensions that this value needs.
    fn put_extensions(&self, _bytes: &mut Vec<u8>) {}
    /// Takes in an extension; false where this message has none of this tag.
    fn take_extension(&mut self, _tag: u16, _data: &[u8]) -> Result<bool> {
        Ok(false)
    }
}

/// Layout of every struct that stands in a packet, for tests of the documentation.
#[must_use]
pub fn struct_layouts() -> Vec<StructLayout> {
    vec![
        crate::message::HeaderRaw::LAYOUT,
        crate::message::ExtensionRaw::LAYOUT,
        handshake::PciAddressRaw::LAYOUT,
        handshake::HelloRaw::LAYOUT,
        handshake::WelcomeRaw::LAYOUT,
        reject::RejectRaw::LAYOUT,
        session::GoodbyeRaw::LAYOUT,
        feedback::ErrorRaw::LAYOUT,
        stream::PlaneSizeRaw::LAYOUT,
        stream::CreateStreamRaw::LAYOUT,
        stream::StreamCreatedRaw::LAYOUT,
        stream::DestroyStreamRaw::LAYOUT,
        stream::StreamEndedRaw::LAYOUT,
        pool::RegisterPoolRaw::LAYOUT,
        pool::PoolAcceptedRaw::LAYOUT,
        submit::PlaneRaw::LAYOUT,
        submit::SubmitRaw::LAYOUT,
        submit::SlotReleasedRaw::LAYOUT,
        camera::LateCameraRaw::LAYOUT,
        ui::UiPlaneRaw::LAYOUT,
        feedback::PresentedRaw::LAYOUT,
        feedback::StatisticsRaw::LAYOUT,
        feedback::PacingRaw::LAYOUT,
        feedback::HintRaw::LAYOUT,
        output::SubscribeRaw::LAYOUT,
        output::UnsubscribeRaw::LAYOUT,
        output::OutputPoolRaw::LAYOUT,
        output::OutputFrameRaw::LAYOUT,
        output::OutputReleasedRaw::LAYOUT,
        output::OutputEndedRaw::LAYOUT,
    ]
}

/// Every closed set of numbers, for tests of the documentation.
#[must_use]
pub fn enum_layouts() -> Vec<EnumLayout> {
    use crate::format as f;
    vec![
        MessageKind::LAYOUT,
        crate::plane::PlaneKind::LAYOUT,
        f::ColorFormat::LAYOUT,
        f::Transfer::LAYOUT,
        f::Primaries::LAYOUT,
        f::ValidRectUse::LAYOUT,
        f::DepthFormat::LAYOUT,
        f::DepthMeaning::LAYOUT,
        f::MotionFormat::LAYOUT,
        f::MotionDirection::LAYOUT,
        f::MotionUnit::LAYOUT,
        f::CameraMotion::LAYOUT,
        f::MaskFormat::LAYOUT,
        f::MaskClass::LAYOUT,
        handshake::Clock::LAYOUT,
        handshake::GpuKind::LAYOUT,
        reject::RejectCode::LAYOUT,
        session::EndReason::LAYOUT,
        feedback::ErrorCode::LAYOUT,
        submit::ReleaseReason::LAYOUT,
        output::OutputKind::LAYOUT,
    ]
}
