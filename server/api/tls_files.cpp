#include "server/api/tls_files.h"

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <filesystem>
#include <memory>
#include <system_error>

namespace drape::api {
namespace {

template <auto kFree>
struct Freed {
  template <typename T>
  void operator()(T* object) const {
    kFree(object);
  }
};
using Bio = std::unique_ptr<BIO, Freed<BIO_free_all>>;
using Certificate = std::unique_ptr<X509, Freed<X509_free>>;
using Key = std::unique_ptr<EVP_PKEY, Freed<EVP_PKEY_free>>;

Status TlsFileFailed(const std::string& path, const std::string& why) {
  ERR_clear_error();
  return {StatusCode::kFailedPrecondition, "TLS_FILE_FAILED", "'" + path + "' " + why};
}

// Null: no such file.
Bio Open(const std::string& path) {
  std::error_code ignored;  // a missing file is not a regular file either
  if (!std::filesystem::is_regular_file(path, ignored)) return nullptr;
  return Bio(BIO_new_file(path.c_str(), "rb"));
}

// A key that asks for a password is refused: nobody would be there to give it.
int NoPassword(char*, int, int, void*) {
  return -1;
}

Result<Certificate> ReadCertificate(const std::string& path) {
  const Bio file = Open(path);
  if (!file) return TlsFileFailed(path, "cannot be read");
  Certificate certificate(PEM_read_bio_X509(file.get(), nullptr, NoPassword, nullptr));
  if (!certificate) return TlsFileFailed(path, "has no certificate (PEM)");
  return certificate;
}

Result<Key> ReadKey(const std::string& path) {
  const Bio file = Open(path);
  if (!file) return TlsFileFailed(path, "cannot be read");
  Key key(PEM_read_bio_PrivateKey(file.get(), nullptr, NoPassword, nullptr));
  if (!key) return TlsFileFailed(path, "has no private key without a password (PEM)");
  return key;
}

}  // namespace

Status CheckTlsFiles(const TlsFiles& files) {
  if (files.is_on()) {
    DRAPE_ASSIGN_OR_RETURN(const Certificate certificate, ReadCertificate(files.certificate));
    DRAPE_ASSIGN_OR_RETURN(const Key key, ReadKey(files.key));
    if (X509_check_private_key(certificate.get(), key.get()) != 1) {
      return TlsFileFailed(files.key, "is not the key of '" + files.certificate + "'");
    }
  }
  if (files.client_authorities.empty()) return Status::Ok();
  return ReadCertificate(files.client_authorities).status();
}

std::optional<Status> TlsWatch::Look() {
  Status now = CheckTlsFiles(files_);
  if (now.ok() == last_.ok() && now.message() == last_.message()) return std::nullopt;
  last_ = now;
  return now;
}

}  // namespace drape::api
