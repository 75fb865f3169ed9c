//! `wire_struct!` and `wire_enum!`: one place where an offset or a code is written down.

use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// One field of a struct on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FieldLayout {
    /// Name, as in `PROTOCOL.md`.
    pub name: &'static str,
    /// Bytes from the start of the struct.
    pub offset: usize,
    /// Bytes of the field.
    pub size: usize,
    /// Type as the Rust source spells it, without spaces.
    pub type_name: &'static str,
}

/// One struct on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StructLayout {
    /// Name, ending in `Raw`.
    pub name: &'static str,
    /// Bytes.
    pub size: usize,
    /// All of it, in order and without gaps.
    pub fields: &'static [FieldLayout],
}

/// One closed set of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EnumLayout {
    /// Name of the Rust type.
    pub name: &'static str,
    /// Code and name of each value.
    pub values: &'static [(u32, &'static str)],
}

/// A struct that can be copied out of a packet whatever its bytes are.
pub(crate) trait RawLayout: FromBytes + IntoBytes + Immutable + KnownLayout + Copy {
    /// Its fields.
    const LAYOUT: StructLayout;
}

/// Declares a raw struct with its size and the offset of each field, asserted at compile time.
macro_rules! wire_struct {
    ($(#[$meta:meta])* $name:ident, $size:literal {
        $($offset:literal $field:ident: $type:ty,)*
    }) => {
        $(#[$meta])*
        #[derive(
            Clone, Copy, Debug,
            zerocopy::FromBytes, zerocopy::IntoBytes, zerocopy::Immutable,
            zerocopy::KnownLayout, zerocopy::Unaligned,
        )]
        #[repr(C)]
        pub(crate) struct $name {
            $(pub(crate) $field: $type,)*
        }
        const _: () = assert!(size_of::<$name>() == $size && align_of::<$name>() == 1);
        $(const _: () = assert!(std::mem::offset_of!($name, $field) == $offset);)*
        impl crate::layout::RawLayout for $name {
            const LAYOUT: crate::layout::StructLayout = crate::layout::StructLayout {
                name: stringify!($name),
                size: $size,
                fields: &[$(crate::layout::FieldLayout {
                    name: stringify!($field),
                    offset: $offset,
                    size: size_of::<$type>(),
                    type_name: stringify!($type),
                },)*],
            };
        }
    };
}

/// Declares an enum with the code and the name of each value.
macro_rules! wire_enum {
    ($(#[$meta:meta])* $name:ident {
        $($(#[$value_meta:meta])* $value:ident = $code:literal $text:literal,)*
    }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
        pub enum $name {
            $($(#[$value_meta])* $value,)*
        }

        impl $name {
            /// Every value, in the order of the codes.
            pub const ALL: &[Self] = &[$(Self::$value,)*];
            /// Codes and names, as `PROTOCOL.md` lists them.
            pub const LAYOUT: crate::layout::EnumLayout = crate::layout::EnumLayout {
                name: stringify!($name),
                values: &[$(($code, $text),)*],
            };

            /// The number on the wire.
            #[must_use]
            pub const fn code(self) -> u32 {
                match self { $(Self::$value => $code,)* }
            }

            /// The name in documents, logs and messages.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$value => $text,)* }
            }

            /// The value with this number, if there is one.
            #[must_use]
            pub const fn from_code(code: u32) -> Option<Self> {
                match code { $($code => Some(Self::$value),)* _ => None }
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(self.name())
            }
        }

        impl crate::wire::check::Coded for $name {
            const LAYOUT: crate::layout::EnumLayout = Self::LAYOUT;
            fn from_code(code: u32) -> Option<Self> {
                Self::from_code(code)
            }
        }
    };
}
