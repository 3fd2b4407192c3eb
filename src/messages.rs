//! Messages of the core's errors. Firmware that formats no error does not link them.

/// Implements `Display` for an enum whose every variant has a constant message, and `Error` unless `no error` is given.
macro_rules! messages {
    (no error $name:ident { $($variant:ident => $message:literal,)+ }) => {
        impl core::fmt::Display for $name {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                f.write_str(match self {
                    $(Self::$variant => $message,)+
                })
            }
        }
    };
    ($name:ident { $($variant:ident => $message:literal,)+ }) => {
        $crate::messages::messages!(no error $name { $($variant => $message,)+ });

        impl core::error::Error for $name {}
    };
}

pub(crate) use messages;
