//! Hello and welcome: who the client is, what the daemon grants.

use std::fmt;
use std::str::FromStr;

use zerocopy::little_endian::{U16, U32, U64};

use super::Wire;
use super::check::Check;
use crate::error::{Error, Result};
use crate::limits::{MAJOR, MAX_POOL_BYTES, MAX_SIZE, MAX_SLOTS, MINOR};
use crate::message::MessageKind;
use crate::text;

/// A set of optional parts of the protocol, one bit each.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Features(pub u64);

impl Features {
    /// None of them.
    pub const NONE: Self = Self(0);
    /// Output frames for subscribers.
    pub const OUTPUT: Self = Self(1);
    /// Late camera messages are used.
    pub const LATE_CAMERA: Self = Self(1 << 1);
    /// UI planes are composited.
    pub const UI_PLANE: Self = Self(1 << 2);
    /// Mask planes are used.
    pub const MASK_PLANE: Self = Self(1 << 3);

    /// All of both.
    #[must_use]
    pub const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// What is in both.
    #[must_use]
    pub const fn common(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    /// Whether all of `other` is in it.
    #[must_use]
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }
}

/// Where a graphics card sits on the PCI bus.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct PciAddress {
    /// PCI domain, 0 to 65535.
    pub domain: u16,
    /// Bus.
    pub bus: u8,
    /// Device, 0 to 31.
    pub device: u8,
    /// Function, 0 to 7.
    pub function: u8,
}

impl fmt::Display for PciAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { domain, bus, device, function } = self;
        write!(f, "{domain:04x}:{bus:02x}:{device:02x}.{function:x}")
    }
}

impl FromStr for PciAddress {
    type Err = Error;

    /// Reads the form `0000:01:00.0`; the domain may be left out.
    fn from_str(text: &str) -> Result<Self> {
        let parsed = || {
            let (rest, function) = text.rsplit_once('.')?;
            let (rest, device) = rest.rsplit_once(':')?;
            let (domain, bus) = rest.rsplit_once(':').unwrap_or(("0", rest));
            let address = Self {
                domain: u16::from_str_radix(domain, 16).ok()?,
                bus: u8::from_str_radix(bus, 16).ok()?,
                device: u8::from_str_radix(device, 16).ok()?,
                function: u8::from_str_radix(function, 16).ok()?,
            };
            (address.device < 32 && address.function < 8).then_some(address)
        };
        parsed().ok_or_else(|| {
            let expected = "a PCI bus id such as 0000:01:00.0";
            Error::field(MessageKind::Hello, "gpu_pci", expected, text)
        })
    }
}

wire_struct! {
    /// See [`PciAddress`].
    PciAddressRaw, 8 {
        0 is_present: U16,
        2 domain: U16,
        4 bus: u8,
        5 device: u8,
        6 function: u8,
        7 reserved: u8,
    }
}

impl PciAddressRaw {
    fn new(address: Option<PciAddress>) -> Self {
        let (is_present, address) = address
            .map_or((0, PciAddress { domain: 0, bus: 0, device: 0, function: 0 }), |address| {
                (1, address)
            });
        Self {
            is_present: U16::new(is_present),
            domain: U16::new(address.domain),
            bus: address.bus,
            device: address.device,
            function: address.function,
            reserved: 0,
        }
    }

    fn get(&self, check: Check) -> Result<Option<PciAddress>> {
        let Self { is_present, domain, bus, device, function, reserved } = *self;
        check.zero("gpu_pci.reserved", &reserved)?;
        check.range("gpu_pci.is_present", u64::from(is_present.get()), 0, 1)?;
        if is_present == 0 {
            check.zero("gpu_pci", self)?;
            return Ok(None);
        }
        check.range("gpu_pci.device", u64::from(device), 0, 31)?;
        check.range("gpu_pci.function", u64::from(function), 0, 7)?;
        Ok(Some(PciAddress { domain: domain.get(), bus, device, function }))
    }
}

wire_struct! {
    /// See [`Hello`].
    HelloRaw, 120 {
        0 major: U16,
        2 minor: U16,
        4 application_length: U32,
        8 required_features: U64,
        16 optional_features: U64,
        24 gpu_pci: PciAddressRaw,
        32 gpu_uuid: [u8; 16],
        48 has_gpu_uuid: U32,
        52 reserved: U32,
        56 application: [u8; 64],
    }
}

/// First packet of a session.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Hello {
    /// Major version that the client speaks.
    pub major: u16,
    /// Minor version that the client speaks.
    pub minor: u16,
    /// Features without which the client has no use for a session.
    pub required_features: Features,
    /// Features that the client can use.
    pub optional_features: Features,
    /// Name of the application, up to 64 bytes.
    pub application: String,
    /// The card that the application renders on, so that the daemon can pick another.
    pub gpu_pci: Option<PciAddress>,
    /// Vulkan's device UUID of that card.
    pub gpu_uuid: Option<[u8; 16]>,
}

impl Hello {
    /// A client of this version that requires nothing and understands everything.
    #[must_use]
    pub fn new(application: impl Into<String>) -> Self {
        Self {
            major: MAJOR,
            minor: MINOR,
            required_features: Features::NONE,
            optional_features: Features::OUTPUT
                .with(Features::LATE_CAMERA)
                .with(Features::UI_PLANE)
                .with(Features::MASK_PLANE),
            application: application.into(),
            gpu_pci: None,
            gpu_uuid: None,
        }
    }
}

impl Wire for Hello {
    type Raw = HelloRaw;
    const KIND: MessageKind = MessageKind::Hello;

    fn to_raw(&self) -> HelloRaw {
        let (application_length, application) = text::put(&self.application);
        HelloRaw {
            major: U16::new(self.major),
            minor: U16::new(self.minor),
            application_length,
            required_features: U64::new(self.required_features.0),
            optional_features: U64::new(self.optional_features.0),
            gpu_pci: PciAddressRaw::new(self.gpu_pci),
            gpu_uuid: self.gpu_uuid.unwrap_or_default(),
            has_gpu_uuid: U32::new(u32::from(self.gpu_uuid.is_some())),
            reserved: U32::ZERO,
            application,
        }
    }

    fn from_raw(raw: &HelloRaw) -> Result<Self> {
        let check = Check(Self::KIND);
        if raw.major != MAJOR {
            return Err(Error::Version { expected: MAJOR, found: raw.major.get() });
        }
        check.zero("reserved", &raw.reserved)?;
        check.range("has_gpu_uuid", u64::from(raw.has_gpu_uuid.get()), 0, 1)?;
        let has_uuid = raw.has_gpu_uuid != 0;
        if !has_uuid {
            check.zero("gpu_uuid", &raw.gpu_uuid)?;
        }
        Ok(Self {
            major: raw.major.get(),
            minor: raw.minor.get(),
            required_features: Features(raw.required_features.get()),
            optional_features: Features(raw.optional_features.get()),
            application: text::get(check, "application", raw.application_length, &raw.application)?,
            gpu_pci: raw.gpu_pci.get(check)?,
            gpu_uuid: has_uuid.then_some(raw.gpu_uuid),
        })
    }
}

wire_enum! {
    /// Clock of every instant in a session.
    Clock {
        /// `CLOCK_MONOTONIC` of the machine.
        Monotonic = 1 "monotonic",
    }
}

wire_enum! {
    /// What makes the in-between frames.
    GpuKind {
        /// The processor, by our own code.
        Cpu = 1 "cpu",
        /// A GPU inside the processor.
        Integrated = 2 "integrated",
        /// A card.
        Discrete = 3 "discrete",
        /// A GPU of the host of a virtual machine.
        Virtual = 4 "virtual",
        /// A driver that computes on the processor.
        Software = 5 "software",
        /// A driver that does not say.
        Unknown = 6 "unknown",
    }
}

wire_struct! {
    /// See [`Welcome`].
    WelcomeRaw, 144 {
        0 major: U16,
        2 minor: U16,
        4 session: U32,
        8 features: U64,
        16 clock_now_ns: U64,
        24 clock: U32,
        28 max_streams: U32,
        32 max_slots: U32,
        36 max_width: U32,
        40 max_height: U32,
        44 reserved: U32,
        48 max_pool_bytes: U64,
        56 refresh_interval_ns: U64,
        64 gpu_pci: PciAddressRaw,
        72 gpu_kind: U32,
        76 gpu_name_length: U32,
        80 gpu_name: [u8; 64],
    }
}

/// The session starts: what the client may do, and who works for it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Welcome {
    /// Major version of the session.
    pub major: u16,
    /// Minor version that the daemon speaks.
    pub minor: u16,
    /// Number of the session, for logs on either side.
    pub session: u32,
    /// Features that both sides have.
    pub features: Features,
    /// Clock of all instants in this session.
    pub clock: Clock,
    /// Reading of that clock when the welcome was sent, so that a client in another time
    /// namespace notices.
    pub clock_now_ns: u64,
    /// Streams that may exist at once.
    pub max_streams: u32,
    /// Slots of one stream, 1 to 8.
    pub max_slots: u32,
    /// Widest colour plane, 1 to 8192.
    pub max_width: u32,
    /// Highest colour plane, 1 to 8192.
    pub max_height: u32,
    /// Bytes of all pools of the session together.
    pub max_pool_bytes: u64,
    /// Time between two refreshes of the display; 0 where it is not known yet.
    pub refresh_interval_ns: u64,
    /// What makes the in-between frames.
    pub gpu_kind: GpuKind,
    /// Its name, up to 64 bytes.
    pub gpu_name: String,
    /// Where it sits, for a card.
    pub gpu_pci: Option<PciAddress>,
}

impl Wire for Welcome {
    type Raw = WelcomeRaw;
    const KIND: MessageKind = MessageKind::Welcome;

    fn to_raw(&self) -> WelcomeRaw {
        let (gpu_name_length, gpu_name) = text::put(&self.gpu_name);
        WelcomeRaw {
            major: U16::new(self.major),
            minor: U16::new(self.minor),
            session: U32::new(self.session),
            features: U64::new(self.features.0),
            clock_now_ns: U64::new(self.clock_now_ns),
            clock: U32::new(self.clock.code()),
            max_streams: U32::new(self.max_streams),
            max_slots: U32::new(self.max_slots),
            max_width: U32::new(self.max_width),
            max_height: U32::new(self.max_height),
            reserved: U32::ZERO,
            max_pool_bytes: U64::new(self.max_pool_bytes),
            refresh_interval_ns: U64::new(self.refresh_interval_ns),
            gpu_pci: PciAddressRaw::new(self.gpu_pci),
            gpu_kind: U32::new(self.gpu_kind.code()),
            gpu_name_length,
            gpu_name,
        }
    }

    fn from_raw(raw: &WelcomeRaw) -> Result<Self> {
        let check = Check(Self::KIND);
        if raw.major != MAJOR {
            return Err(Error::Version { expected: MAJOR, found: raw.major.get() });
        }
        check.zero("reserved", &raw.reserved)?;
        let bounds = [
            ("max_streams", raw.max_streams, u32::MAX),
            ("max_slots", raw.max_slots, MAX_SLOTS),
            ("max_width", raw.max_width, MAX_SIZE),
            ("max_height", raw.max_height, MAX_SIZE),
        ];
        for (field, value, max) in bounds {
            check.range(field, u64::from(value.get()), 1, u64::from(max))?;
        }
        check.range("max_pool_bytes", raw.max_pool_bytes.get(), 1, MAX_POOL_BYTES)?;
        Ok(Self {
            major: raw.major.get(),
            minor: raw.minor.get(),
            session: raw.session.get(),
            features: Features(raw.features.get()),
            clock: check.coded("clock", raw.clock)?,
            clock_now_ns: check.time("clock_now_ns", raw.clock_now_ns.get())?,
            max_streams: raw.max_streams.get(),
            max_slots: raw.max_slots.get(),
            max_width: raw.max_width.get(),
            max_height: raw.max_height.get(),
            max_pool_bytes: raw.max_pool_bytes.get(),
            refresh_interval_ns: check
                .time("refresh_interval_ns", raw.refresh_interval_ns.get())?,
            gpu_kind: check.coded("gpu_kind", raw.gpu_kind)?,
            gpu_name: text::get(check, "gpu_name", raw.gpu_name_length, &raw.gpu_name)?,
            gpu_pci: raw.gpu_pci.get(check)?,
        })
    }
}
