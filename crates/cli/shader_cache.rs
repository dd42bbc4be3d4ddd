//! Where Mesa keeps compiled programs: a folder of our own in the user's cache folder, so that what other programs compile does
//! not crowd ours out, and so that it is known which programs are in it. Mesa's files don't say how wide the vectors are that
//! they were compiled for (`LP_NATIVE_VECTOR_WIDTH`): programs of 4 lanes that are read back for 8 give wrong pictures.

use std::{env, ffi::OsString, fs, path::PathBuf};

/// What decides where the cache is.
#[derive(Default)]
struct Environment {
    /// `MESA_SHADER_CACHE_DIR`, or the older `MESA_GLSL_CACHE_DIR`: the user has chosen.
    chosen: Option<OsString>,
    /// `XDG_CACHE_HOME`
    cache_home: Option<OsString>,
    /// `HOME`
    home: Option<OsString>,
    /// `LP_NATIVE_VECTOR_WIDTH`, bits.
    vector_width: Option<OsString>,
}

/// Tells Mesa of our folder, unless the user has told it of another.
///
/// Must be the first thing that the program does: the environment is not guarded against other threads.
pub fn use_own_folder() {
    let found = Environment {
        chosen: env::var_os("MESA_SHADER_CACHE_DIR").or_else(|| env::var_os("MESA_GLSL_CACHE_DIR")),
        cache_home: env::var_os("XDG_CACHE_HOME"),
        home: env::var_os("HOME"),
        vector_width: env::var_os("LP_NATIVE_VECTOR_WIDTH"),
    };
    // Where there can be none, Mesa finds its own way.
    let folder = folder(&found).filter(|folder| fs::create_dir_all(folder).is_ok());
    if let Some(folder) = folder {
        #[allow(
            unsafe_code,
            reason = "Mesa has no other way to be told; starting ourselves anew with another environment would cost more"
        )]
        // SAFETY: `main` calls this before it starts a thread or calls anything that does.
        unsafe {
            env::set_var("MESA_SHADER_CACHE_DIR", folder);
        }
    }
}

/// Our folder; `None`: leave it as it is.
fn folder(found: &Environment) -> Option<PathBuf> {
    if found.chosen.is_some() {
        return None;
    }
    let ours = own_caches(found.cache_home.as_ref(), found.home.as_ref())?;
    let mut name = OsString::from("shaders");
    if let Some(width) = &found.vector_width {
        name.push("-");
        name.push(width);
    }
    Some(ours.join(name))
}

/// The folder of all that this program caches, if the user has one.
pub fn own_cache_folder() -> Option<PathBuf> {
    own_caches(
        env::var_os("XDG_CACHE_HOME").as_ref(),
        env::var_os("HOME").as_ref(),
    )
}

/// The XDG Base Directory Specification: a path that is not absolute counts as none.
fn own_caches(cache_home: Option<&OsString>, home: Option<&OsString>) -> Option<PathBuf> {
    let absolute = |path: &OsString| Some(PathBuf::from(path)).filter(|path| path.is_absolute());
    let caches = cache_home
        .and_then(absolute)
        .or_else(|| home.and_then(absolute).map(|home| home.join(".cache")))?;
    Some(caches.join("raytree"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_lies_in_the_users_cache_folder() {
        let home = || Some(OsString::from("/home/me"));
        let of = |found: Environment| folder(&found).map(|path| path.display().to_string());
        let at_home = Environment {
            home: home(),
            ..Environment::default()
        };
        assert_eq!(of(at_home).unwrap(), "/home/me/.cache/raytree/shaders");
        let elsewhere = Environment {
            cache_home: Some("/var/cache".into()),
            home: home(),
            vector_width: Some("128".into()),
            ..Environment::default()
        };
        assert_eq!(of(elsewhere).unwrap(), "/var/cache/raytree/shaders-128");
        let relative = Environment {
            cache_home: Some("cache".into()),
            home: home(),
            ..Environment::default()
        };
        assert_eq!(of(relative).unwrap(), "/home/me/.cache/raytree/shaders");
        assert_eq!(of(Environment::default()), None);
        let chosen = Environment {
            chosen: Some("/elsewhere".into()),
            home: home(),
            ..Environment::default()
        };
        assert_eq!(of(chosen), None);
    }
}
