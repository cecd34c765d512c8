//! The two macros; [`super`] shows how they are used.

/// Declares a section: struct, default, parsing, checking, reference.
macro_rules! section {
    (
        $(#[doc = $about:literal])*
        pub struct $name:ident in $section:literal $(, checked by $together:ident)? {
            $(
                $(#[doc = $meaning:literal])*
                $field:ident: $ty:ty = $default:expr
                    $(, follows $follows:literal)? $(, in $range:expr)? $(, unit $unit:literal)?;
            )*
        }
        $(also {
            $( $(#[doc = $also_doc:literal])* $also:ident: $also_ty:ty = $also_default:expr; )*
        })?
        $(sections { $( $sub:ident: $sub_ty:ty; )* })?
    ) => {
        $(#[doc = $about])*
        #[derive(Clone, Debug, PartialEq, serde::Serialize)]
        pub struct $name {
            $(
                $(#[doc = $meaning])*
                #[doc = ""]
                #[doc = concat!("Default `", stringify!($default), "`")]
                $(#[doc = concat!("(follows ", $follows, ")")])?
                $(#[doc = concat!(", range `", stringify!($range), "`")])?
                $(#[doc = concat!(", in ", $unit)])?
                #[doc = "."]
                pub $field: $ty,
            )*
            $($( $(#[doc = $also_doc])* #[serde(skip)] pub $also: $also_ty, )*)?
            $($( #[doc = concat!("Section `", stringify!($sub), "`.")] pub $sub: $sub_ty, )*)?
        }

        impl Default for $name {
            fn default() -> Self {
                Self {
                    $( $field: $default, )*
                    $($( $also: $also_default, )*)?
                    $($( $sub: <$sub_ty>::default(), )*)?
                }
            }
        }

        impl $name {
            /// Whether every value is in its range, and what belongs together fits.
            ///
            /// # Errors
            /// [`crate::error::Error::Setting`] for the first that is not.
            pub fn validate(&self) -> $crate::error::Result<()> {
                $crate::settings::Section::validate(self)
            }
        }

        #[allow(unused_imports, unused_variables, unused_mut, clippy::vec_init_then_push,
            reason = "sections without ranges or without sections in them")]
        const _: () = {
            use $crate::settings::{self, Group, Section, Setting, Value, above, from};

            impl Section for $name {
                const NAME: &'static str = $section;

                fn groups() -> Vec<Group> {
                    let default = Self::default();
                    let mut groups = vec![Group {
                        name: $section,
                        meaning: concat!($($about),*).trim().to_owned(),
                        settings: vec![$( settings::entry::<$ty>(
                            settings::dotted($section, stringify!($field)),
                            &default.$field,
                            [$(Some($follows),)? None][0],
                            [$($range,)? <$ty as Value>::RANGE][0],
                            [$($unit,)? ""][0],
                            concat!($($meaning),*),
                        ), )*],
                    }];
                    $($( groups.extend(<$sub_ty as Section>::groups()); )*)?
                    groups
                }

                fn set(&mut self, key: &str, value: &toml::Value) -> $crate::error::Result<()> {
                    let dotted = settings::dotted($section, key);
                    match key {
                        $( stringify!($field) => {
                            let range = [$($range,)? <$ty as Value>::RANGE][0];
                            self.$field = settings::read(&dotted, range, value)?;
                        } )*
                        $($( stringify!($sub) => settings::set_all(&mut self.$sub, value)?, )*)?
                        _ => return Err($crate::error::Error::setting(dotted, "unknown key")),
                    }
                    Ok(())
                }

                fn validate(&self) -> $crate::error::Result<()> {
                    $( settings::check(
                        &settings::dotted($section, stringify!($field)),
                        [$($range,)? <$ty as Value>::RANGE][0],
                        &self.$field,
                    )?; )*
                    $($( Section::validate(&self.$sub)?; )*)?
                    $( self.$together()?; )?
                    Ok(())
                }
            }
        };
    };
}

/// Declares an enum whose words a setting can be.
macro_rules! choices {
    (
        $(#[$meta:meta])*
        pub enum $name:ident default $default:ident {
            $( $(#[doc = $doc:literal])* $variant:ident = $word:literal, )+
        }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $name { $( $(#[doc = $doc])* $variant, )+ }

        impl Default for $name {
            fn default() -> Self {
                Self::$default
            }
        }

        impl $name {
            /// As it is written in settings.
            pub fn name(self) -> &'static str {
                match self { $( Self::$variant => $word, )+ }
            }
        }

        impl serde::Serialize for $name {
            fn serialize<S: serde::Serializer>(
                &self,
                s: S,
            ) -> std::result::Result<S::Ok, S::Error> {
                s.serialize_str(self.name())
            }
        }

        impl $crate::settings::Value for $name {
            const KIND: &'static str = "choice";
            fn read(value: &toml::Value) -> Option<Self> {
                match value.as_str()? { $( $word => Some(Self::$variant), )+ _ => None }
            }
            fn show(&self) -> String {
                self.name().to_owned()
            }
            fn choices() -> Vec<$crate::settings::Choice> {
                vec![$( $crate::settings::Choice {
                    name: $word,
                    meaning: concat!($($doc),*),
                }, )+]
            }
        }
    };
}

pub(crate) use {choices, section};
