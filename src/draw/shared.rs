//! Declares constants and structs once for host and shaders.
//!
//! Only four-byte scalars, their vectors, and structs of these occur. For them scalar block layout and `#[repr(C)]`
//! agree without padding; a test compares the offsets with the compiled SPIR-V. `build.rs` includes this file by path.

/// Host types under GLSL's names.
#[allow(non_camel_case_types, missing_docs)]
pub mod glsl {
    pub type uint = u32;
    pub type int = i32;
    pub type float = f32;
    pub type uvec3 = [u32; 3];
    pub type uvec2 = [u32; 2];
    pub type uvec4 = [u32; 4];
    pub type ivec2 = [i32; 2];
    pub type vec2 = [f32; 2];
    pub type vec3 = [f32; 3];
    pub type vec4 = [f32; 4];
    pub type mat4 = [[f32; 4]; 4];
}

/// One field of a shared struct: its name and its byte offset on the host.
pub type Offset = (&'static str, usize);

/// Declares constants and structs, their GLSL source, and the list of the structs. The caller imports [`glsl`].
macro_rules! shared {
    (
        $(const { $($(#[$constant_doc:meta])* $constant:ident: $constant_type:ident = $value:literal;)* })?
        $($(#[$doc:meta])* struct $name:ident { $($(#[$field_doc:meta])* $field:ident: $type:ident,)* })*
    ) => {
        $($($(#[$constant_doc])* pub const $constant: $constant_type = $value;)*)?

        $(
            $(#[$doc])*
            #[repr(C)]
            #[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
            pub struct $name { $($(#[$field_doc])* pub $field: $type,)* }
        )*

        /// The constants and structs as GLSL declarations.
        pub const GLSL: &str = concat!(
            $($("const ", stringify!($constant_type), " ", stringify!($constant), " = ",
                stringify!($constant_type), "(", stringify!($value), ");\n",)*)?
            $("struct ", stringify!($name), " {\n",
                $("    ", stringify!($type), " ", stringify!($field), ";\n",)* "};\n\n",)*
        );

        /// Name, size in bytes and field offsets of each struct.
        pub fn structs() -> Vec<(&'static str, usize, Vec<$crate::draw::shared::Offset>)> {
            vec![$((stringify!($name), size_of::<$name>(),
                vec![$((stringify!($field), std::mem::offset_of!($name, $field)),)*]),)*]
        }
    };
}
pub(crate) use shared;
