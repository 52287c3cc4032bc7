//! Folders of object stores: S3 and what speaks like it, Google Cloud Storage and Azure, with calls that wait for the answer.
//!
//! Credentials and endpoints come from the environment, as `object_store` names them: `AWS_…`, `GOOGLE_…` and `AZURE_…`.

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
const VARIABLES: [&str; 3] = ["AWS_", "AZURE_", "GOOGLE_"];

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
                path.map(Self::Directory).map_err(|()| io::Error::other(expected))
            }
            _ => Err(io::Error::other(expected)),
        }
    }
}

impl Folder {
    fn open(url: &Url) -> io::Result<Self> {
        // It is installed already if this is not the first folder.
        let _ = rustls::crypto::ring::default_provider().install_default();
        let variables = std::env::vars_os().filter_map(|(name, value)| {
            let (name, value) = (name.into_string().ok()?, value.into_string().ok()?);
            let begins = |prefix: &&str| name.starts_with(prefix);
            VARIABLES.iter().any(|prefix| begins(&prefix)).then_some((name, value))
        });
        let (store, path) = parse_url_opts(url, variables)?;
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
        Ok(self.runtime.block_on(listed)?)
    }

    /// Puts an object by one request, in place of any of this name.
    ///
    /// # Errors
    /// Returns an error if the store does not take it.
    pub fn put(&self, name: &str, contents: Vec<u8>) -> io::Result<()> {
        let path = self.path.clone().join(name);
        self.runtime.block_on(self.store.put(&path, contents.into()))?;
        Ok(())
    }

    /// Begins to get an object.
    pub fn get(&self, name: &str) -> Requested {
        let (store, path) = (Arc::clone(&self.store), self.path.clone().join(name));
        Requested {
            runtime: Arc::clone(&self.runtime),
            contents: self.runtime.spawn(async move { store.get(&path).await?.bytes().await }),
        }
    }
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
        Ok(self.runtime.block_on(self.contents)??)
    }
}
