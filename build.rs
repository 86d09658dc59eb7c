//! Compiles the GLSL of `shaders/`, and of the example `embed`, to SPIR-V 1.6 for Vulkan 1.3 (feature `vulkan`). Records the
//! commit.

#[cfg(feature = "vulkan")]
#[path = "src/draw"]
#[allow(dead_code)]
mod draw {
    pub mod layout;
    pub mod shared;
}
#[cfg(feature = "vulkan")]
#[path = "src/lod/clusters"]
#[allow(dead_code)]
mod clusters {
    pub mod layout;
}
#[cfg(feature = "vulkan")]
#[path = "src/plan"]
#[allow(dead_code)]
mod plan {
    mod colour;
    pub mod constants;
}

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    record_commit();
    println!("cargo:rerun-if-env-changed=DOCS_RS");
    #[cfg(feature = "vulkan")]
    match std::env::var_os("DOCS_RS") {
        // Documentation needs no shaders.
        Some(_) => shaders::write_table("&["),
        None => shaders::compile_all(),
    }
}

/// Sets `CUESTA_COMMIT` in a clone.
fn record_commit() {
    let git = |words: &[&str]| {
        let output = std::process::Command::new("git").args(words).output().ok()?;
        let text = String::from_utf8(output.stdout).ok()?;
        output.status.success().then(|| text.trim().to_string())
    };
    // The log of HEAD changes with every commit and checkout.
    if let (Some(commit), Some(log)) =
        (git(&["rev-parse", "--short=12", "HEAD"]), git(&["rev-parse", "--git-path", "logs/HEAD"]))
    {
        println!("cargo:rustc-env=CUESTA_COMMIT={commit}");
        if std::path::Path::new(&log).exists() {
            println!("cargo:rerun-if-changed={log}");
        }
    }
}

#[cfg(feature = "vulkan")]
mod shaders {
    use std::path::{Path, PathBuf};

    use shaderc::{
        CompileOptions, Compiler, EnvVersion, OptimizationLevel, ResolvedInclude, ShaderKind, SpirvVersion, TargetEnv,
    };

    const STAGES: &[(&str, ShaderKind)] =
        &[("vert", ShaderKind::Vertex), ("frag", ShaderKind::Fragment), ("comp", ShaderKind::Compute)];

    /// Shaders compiled a second time with a macro defined: source, macro, name of the variant.
    const VARIANTS: &[(&str, &str, &str)] = &[
        ("lattice.vert", "CAPTURE", "lattice.capture.vert"),
        ("explicit.vert", "CAPTURE", "explicit.capture.vert"),
        ("explicit.vert", "NORMALS", "explicit.normals.vert"),
        ("terrain.frag", "NORMALS", "terrain.normals.frag"),
    ];

    pub fn compile_all() {
        println!("cargo:rerun-if-changed=shaders");
        for source in ["draw/shared", "draw/layout", "lod/clusters/layout", "plan/colour", "plan/constants"] {
            println!("cargo:rerun-if-changed=src/{source}.rs");
        }
        let compiler = Compiler::new().expect("shaderc starts");
        let table = compile_folder(&compiler, Path::new("shaders"));
        // This example includes its modules by itself.
        let example = Path::new("examples/embed");
        let has_failed = table.is_none() || example.is_dir() && compile_folder(&compiler, example).is_none();
        write_table(&format!("&[\n{}", table.unwrap_or_default()));
        if has_failed {
            std::process::exit(1);
        }
    }

    /// Compiles the shaders of a folder to modules in `OUT_DIR`. Returns their rows of the table; `None` if any fails.
    fn compile_folder(compiler: &Compiler, folder: &Path) -> Option<String> {
        let out = PathBuf::from(std::env::var("OUT_DIR").expect("set by cargo"));
        let mut rows = Some(String::new());
        let mut sources: Vec<_> = std::fs::read_dir(folder).expect("a folder").map(|e| e.unwrap().path()).collect();
        sources.sort();
        for path in sources {
            let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
            let Some((_, kind)) = STAGES.iter().find(|(name, _)| *name == extension) else { continue };
            println!("cargo:rerun-if-changed={}", path.display());
            let name = path.file_name().expect("a file").to_str().expect("UTF-8").to_string();
            let variants = VARIANTS.iter().filter(|(source, ..)| *source == name);
            let variants = variants.map(|(_, define, variant)| (Some(*define), variant.to_string()));
            for (define, name) in std::iter::once((None, name.clone())).chain(variants) {
                match compile(compiler, &path, *kind, define) {
                    Ok(words) => {
                        let spirv = out.join(format!("{name}.spv"));
                        std::fs::write(&spirv, words).expect("OUT_DIR is writable");
                        let row = format!("    ({name:?}, include_bytes!({:?})),\n", spirv.to_str().expect("UTF-8"));
                        rows = rows.map(|rows| rows + &row);
                    }
                    Err(message) => {
                        rows = None;
                        message.lines().for_each(|line| println!("cargo::error={line}"));
                    }
                }
            }
        }
        rows
    }

    /// Closes the table of shaders and writes it where `src/gpu/shaders.rs` includes it.
    pub fn write_table(table: &str) {
        let out = PathBuf::from(std::env::var("OUT_DIR").expect("set by cargo"));
        std::fs::write(out.join("shaders.rs"), format!("{table}]\n")).expect("OUT_DIR is writable");
    }

    fn compile(compiler: &Compiler, path: &Path, kind: ShaderKind, define: Option<&str>) -> Result<Vec<u8>, String> {
        let source = read(path).map_err(|e| format!("{}: {e}", path.display()))?;
        // glslang cuts the source in its debug information at any byte, also within a character.
        if !source.is_ascii() {
            return Err(format!("{}: expected ASCII", path.display()));
        }
        let mut options = CompileOptions::new().map_err(|e| e.to_string())?;
        options.set_target_env(TargetEnv::Vulkan, EnvVersion::Vulkan1_3 as u32);
        options.set_target_spirv(SpirvVersion::V1_6);
        options.set_optimization_level(OptimizationLevel::Performance);
        // Keeps the names of structs and members for the layout test.
        options.set_generate_debug_info();
        options.set_warnings_as_errors();
        if let Some(define) = define {
            options.add_macro_definition(define, None);
        }
        options.set_include_callback(|name, _, from, _| {
            let content = match name {
                "layout.glsl" => Ok(super::draw::layout::GLSL.to_string()),
                "clusters.glsl" => Ok(super::clusters::layout::GLSL.to_string()),
                "constants.glsl" => Ok(super::plan::constants::SceneConstants::glsl()),
                _ => read(&Path::new("shaders").join(name)).map_err(|e| format!("{from}: {name}: {e}")),
            };
            content.map(|content| ResolvedInclude { resolved_name: format!("shaders/{name}"), content })
        });
        compiler
            .compile_into_spirv(&source, kind, &path.to_string_lossy(), "main", Some(&options))
            .map(|artifact| artifact.as_binary_u8().to_vec())
            .map_err(|e| e.to_string())
    }

    /// Reads a source as ASCII: glslang cuts debug strings at any byte, and readers of SPIR-V reject half a character.
    fn read(path: &Path) -> std::io::Result<String> {
        Ok(std::fs::read_to_string(path)?.replace(|c: char| !c.is_ascii(), "?"))
    }
}
