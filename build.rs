//! Finds Embree, compiles `ffi/embree_shim.c` against its headers, binds `ffi/embree_shim.h` and
//! tells the linker where the library is.
//!
//! Embree is looked for in `EMBREE_DIR`, then in `.embree/` (made by `./setup` on systems without a
//! package), then where the system has it. Without the feature `embree`, and on docs.rs, nothing is
//! done.
//!
//! A program linked to a library outside of the system's folders looks for it beside itself first,
//! in `../lib/nearfar` and `../lib` (where `make install` and packagers put it), then where it was
//! at the build.

#[cfg(feature = "embree")]
mod embree {
    use std::path::{Path, PathBuf};
    use std::{env, fs};

    /// Where headers and library are; no folders when the compiler finds them by itself.
    struct Embree {
        include: Option<PathBuf>,
        lib: Option<PathBuf>,
    }

    fn find() -> Embree {
        println!("cargo:rerun-if-env-changed=EMBREE_DIR");
        let prefix = |dir: PathBuf| {
            let lib = ["lib", "lib64"].map(|l| dir.join(l)).into_iter().find(|l| has_library(l));
            Embree { include: Some(dir.join("include")), lib }
        };
        if let Some(dir) = env::var_os("EMBREE_DIR").filter(|d| !d.is_empty()) {
            let found = prefix(PathBuf::from(&dir));
            assert!(
                found.lib.is_some(),
                "EMBREE_DIR={} has no lib/libembree4.so: correct or unset it",
                dir.to_string_lossy()
            );
            return found;
        }
        let private =
            Path::new(&env::var("CARGO_MANIFEST_DIR").expect("set by cargo")).join(".embree");
        println!("cargo:rerun-if-changed={}", private.display());
        if private.join("include/embree4").exists() {
            return prefix(private);
        }
        for dir in ["/usr/local", "/opt/homebrew"] {
            if Path::new(dir).join("include/embree4/rtcore.h").exists() {
                return prefix(dir.into());
            }
        }
        Embree { include: None, lib: None }
    }

    fn has_library(dir: &Path) -> bool {
        ["libembree4.so", "libembree4.so.4", "libembree4.dylib"]
            .iter()
            .any(|f| dir.join(f).exists())
    }

    /// Panics with the fix when the headers are missing or older than 4.3.
    fn check_headers(include: &Path) {
        let config = include.join("embree4/rtcore_config.h");
        println!("cargo:rerun-if-changed={}", config.display());
        let text = fs::read_to_string(&config).unwrap_or_else(|e| {
            panic!(
                "{}: {e}. Run ./setup, set EMBREE_DIR to a prefix of Embree 4.3 or later, or build \
                 with --no-default-features --features cli",
                config.display()
            )
        });
        let number = |name: &str| {
            let line = text.lines().find(|l| l.starts_with(&format!("#define {name} ")));
            line.and_then(|l| l.split_whitespace().nth(2)?.parse().ok()).unwrap_or(0u32)
        };
        let version = (number("RTC_VERSION_MAJOR"), number("RTC_VERSION_MINOR"));
        assert!(
            version.0 == 4 && version.1 >= 3,
            "{}: Embree {}.{}, but 4.3 or later is needed",
            config.display(),
            version.0,
            version.1
        );
    }

    pub fn build() {
        let embree = find();
        let include = embree.include.unwrap_or_else(|| "/usr/include".into());
        check_headers(&include);
        println!("cargo:rerun-if-changed=ffi");
        cc::Build::new()
            .file("ffi/embree_shim.c")
            .include(&include)
            .std("c11")
            .opt_level(3)
            .warnings(true)
            .extra_warnings(true)
            .compile("nearfar_embree_shim");
        let out = PathBuf::from(env::var_os("OUT_DIR").expect("set by cargo"));
        let bindings = bindgen::Builder::default()
            .header("ffi/embree_shim.h")
            .allowlist_function("nf_.*")
            .allowlist_type("Nf.*")
            .allowlist_var("NF_.*")
            .use_core()
            .layout_tests(false)
            .generate()
            .expect("bindgen reads ffi/embree_shim.h")
            .to_string()
            // This bindgen is older than edition 2024.
            .replace("extern \"C\" {", "unsafe extern \"C\" {");
        fs::write(out.join("embree_shim.rs"), bindings).expect("OUT_DIR can be written");
        let lib = embree.lib.map(|l| fs::canonicalize(&l).unwrap_or(l));
        if let Some(lib) = &lib {
            // Cargo adds folders under its own output to the library path of what it runs
            // (documentation tests have no rpath).
            for entry in fs::read_dir(lib).into_iter().flatten().flatten() {
                let name = entry.file_name();
                if name.to_string_lossy().starts_with("libembree4")
                    || name.to_string_lossy().starts_with("libtbb")
                {
                    let link = out.join(&name);
                    let _ = fs::remove_file(&link);
                    #[cfg(unix)]
                    std::os::unix::fs::symlink(entry.path(), link).expect("OUT_DIR can be written");
                }
            }
            println!("cargo:rustc-link-search=native={}", out.display());
            println!("cargo:rustc-link-search=native={}", lib.display());
            let own = match env::var("CARGO_CFG_TARGET_OS").as_deref() {
                Ok("macos") => "@loader_path",
                _ => "$ORIGIN",
            };
            let places = [format!("{own}/../lib/nearfar"), format!("{own}/../lib")];
            for place in places.into_iter().chain([lib.display().to_string()]) {
                println!("cargo:rustc-link-arg=-Wl,-rpath,{place}");
            }
        }
        println!("cargo:rustc-link-lib=embree4");
        println!("cargo:rustc-env=NEARFAR_EMBREE_INCLUDE={}", include.display());
        println!("cargo:rustc-env=NEARFAR_EMBREE_LIB={}", lib.unwrap_or_default().display());
    }
}

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-env-changed=DOCS_RS");
    #[cfg(feature = "embree")]
    if std::env::var_os("DOCS_RS").is_none() {
        embree::build();
    }
}
