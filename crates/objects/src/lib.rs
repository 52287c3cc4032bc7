//! Folders of object stores: S3 and what speaks like it, Google Cloud Storage and Azure, with calls that wait for the answer.
//!
//! Credentials and endpoints come from the environment, as `object_store` names them: `AWS_…`, `GOOGLE_…` and `AZURE_…`.

use std::error::Error;
use std::fmt;
use std::io;
use std::path::PathBuf;
use std::sync::Arc;

pub use bytes::Bytes;
use futures_util::TryStreamExt;
use object_store::path::Path;
use object_store::{ObjectStore, ObjectStoreExt, ObjectStoreScheme, parse_url_opts};
use tokio::runtime::{Builder, Runtime};
use tokio::task::JoinHandle;
use url::Url;

/// What a URL names.
#[derive(Clone, Debug)]
pub enum Target {
    /// A directory of this machine.
    Directory(PathBuf),
    /// A folder of an object store.
    Folder(Folder),
}

/// The objects of a store whose names begin with those of the folder and a slash.
#[derive(Clone)]
pub struct Folder {
    url: Arc<str>,
    path: Path,
    store: Arc<dyn ObjectStore>,
    runtime: Arc<Runtime>,
}

impl fmt::Debug for Folder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Folder").field(&self.url).finish()
    }
}

/// Prefixes of the environment's variables for stores.
const PREFIXES: [&str; 3] = ["AWS_", "AZURE_", "GOOGLE_"];

impl Target {
    /// Opens `s3://bucket/…`, `gs://bucket/…`, `az://container/…` or `file:///…`. Nothing is sent yet.
    ///
    /// # Errors
    /// Returns an error if the text is no such URL, or if the environment does not say what the store needs.
    pub fn open(text: &str) -> io::Result<Self> {
        let url = Url::parse(text).map_err(io::Error::other)?;
        let (scheme, _) = ObjectStoreScheme::parse(&url).map_err(io::Error::other)?;
        let expected = "expected s3://, gs://, az:// or file://, and no query";
        if url.query().is_some() || url.fragment().is_some() {
            return Err(io::Error::other(expected));
        }
        match scheme {
            ObjectStoreScheme::AmazonS3
            | ObjectStoreScheme::GoogleCloudStorage
            | ObjectStoreScheme::MicrosoftAzure => Folder::open(&url).map(Self::Folder),
            ObjectStoreScheme::Local => {
                let path = url.to_file_path();
                path.map(Self::Directory)
                    .map_err(|()| io::Error::other(expected))
            }
            _ => Err(io::Error::other(expected)),
        }
    }
}

impl Folder {
    fn open(url: &Url) -> io::Result<Self> {
        // It is installed already if this is not the first folder.
        let _ = rustls::crypto::ring::default_provider().install_default();
        let variables = variables()?;
        let (store, path) = parse_url_opts(url, variables).map_err(told)?;
        let runtime = Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build()?;
        Ok(Self {
            url: url.as_str().trim_end_matches('/').into(),
            path,
            store: store.into(),
            runtime: Arc::new(runtime),
        })
    }

    /// Returns the URL, without a slash at the end.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// Passes the names of the objects to `each`, in no particular order, without those of folders in the folder.
    ///
    /// # Errors
    /// Returns an error if the store cannot be asked.
    pub fn each_name(&self, mut each: impl FnMut(&str)) -> io::Result<()> {
        let depth = self.path.parts().count() + 1;
        let objects = self.store.list(Some(&self.path));
        let listed = objects.try_for_each(|object| {
            if object.location.parts().count() == depth {
                object.location.filename().into_iter().for_each(&mut each);
            }
            std::future::ready(Ok(()))
        });
        self.runtime.block_on(listed).map_err(told)
    }

    /// Puts an object by one request, in place of any of this name.
    ///
    /// # Errors
    /// Returns an error if the store does not take it.
    pub fn put(&self, name: &str, contents: Vec<u8>) -> io::Result<()> {
        let path = self.path.clone().join(name);
        let put = self.store.put(&path, contents.into());
        self.runtime.block_on(put).map(drop).map_err(told)
    }

    /// Begins to get an object.
    pub fn get(&self, name: &str) -> Requested {
        let (store, path) = (Arc::clone(&self.store), self.path.clone().join(name));
        Requested {
            runtime: Arc::clone(&self.runtime),
            contents: self
                .runtime
                .spawn(async move { store.get(&path).await?.bytes().await }),
        }
    }
}

/// Returns the environment's variables for stores.
fn variables() -> io::Result<Vec<(String, String)>> {
    let mut variables = Vec::new();
    for (name, value) in std::env::vars_os() {
        let (Ok(name), Ok(mut value)) = (name.into_string(), value.into_string()) else {
            continue;
        };
        if !PREFIXES.iter().any(|prefix| name.starts_with(prefix)) {
            continue;
        }
        // `object_store` panics at endpoints that are no URLs.
        if name.contains("ENDPOINT") {
            let url = Url::parse(&value).ok().filter(Url::has_host);
            let url = url.ok_or_else(|| {
                io::Error::other(format!("{name} is {value:?}, expected a URL with a host"))
            })?;
            value = url.as_str().trim_end_matches('/').into();
        }
        variables.push((name, value));
    }
    Ok(variables)
}

/// An object that is under way.
pub struct Requested {
    runtime: Arc<Runtime>,
    contents: JoinHandle<object_store::Result<Bytes>>,
}

impl Requested {
    /// Returns its contents.
    ///
    /// # Errors
    /// Returns an error if the store has no such object or cannot be asked.
    pub fn wait(self) -> io::Result<Bytes> {
        self.runtime.block_on(self.contents)?.map_err(told)
    }
}

/// Returns the error with all its causes, of which it tells the first.
fn told(error: object_store::Error) -> io::Error {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(deeper) = cause {
        let further = deeper.to_string();
        if !text.contains(&further) {
            text = format!("{text}: {further}");
        }
        cause = deeper.source();
    }
    io::Error::new(io::Error::from(error).kind(), text)
}
