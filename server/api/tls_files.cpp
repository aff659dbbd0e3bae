#include "server/api/tls_files.h"

#include <fcntl.h>
#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <sys/mman.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <new>
#include <system_error>
#include <utility>
#include <vector>

#include "server/core/memory_reserve.h"

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

Result<std::string> ContentOf(const std::string& path) {
  std::error_code ignored;  // a missing file is not a regular file either
  std::ifstream file;
  if (std::filesystem::is_regular_file(path, ignored)) file.open(path, std::ios::binary);
  if (!file.is_open()) return TlsFileFailed(path, "cannot be read");
  return std::string{std::istreambuf_iterator<char>(file), {}};
}

Bio Reading(const std::string& content) {
  return Bio(BIO_new_mem_buf(content.data(), static_cast<int>(content.size())));
}

// A key that asks for a password is refused: nobody would be there to give it.
int NoPassword(char*, int, int, void*) {
  return -1;
}

// At least one: the chain.
Result<std::vector<Certificate>> ReadCertificates(const std::string& path) {
  DRAPE_ASSIGN_OR_RETURN(const std::string content, ContentOf(path));
  const Bio file = Reading(content);
  std::vector<Certificate> chain;
  while (X509* const next = PEM_read_bio_X509(file.get(), nullptr, NoPassword, nullptr)) {
    chain.emplace_back(next);
  }
  const bool is_whole = ERR_GET_REASON(ERR_peek_last_error()) == PEM_R_NO_START_LINE;
  if (is_whole && chain.empty()) return TlsFileFailed(path, "has no certificate (PEM)");
  if (!is_whole) return TlsFileFailed(path, "has a certificate that cannot be read (PEM)");
  ERR_clear_error();
  return chain;
}

Result<Key> ReadKey(const std::string& path) {
  DRAPE_ASSIGN_OR_RETURN(const std::string content, ContentOf(path));
  const Bio file = Reading(content);
  Key key(PEM_read_bio_PrivateKey(file.get(), nullptr, NoPassword, nullptr));
  if (!key) return TlsFileFailed(path, "has no private key without a password (PEM)");
  return key;
}

// As PEM.
std::string Written(const std::vector<Certificate>& chain, const Key& key = nullptr) {
  const Bio all(BIO_new(BIO_s_mem()));
  bool is_whole = all != nullptr;
  if (key != nullptr) {
    is_whole = is_whole && PEM_write_bio_PrivateKey(all.get(), key.get(), nullptr, nullptr, 0,
                                                    nullptr, nullptr) == 1;
  }
  for (const Certificate& one : chain) {
    is_whole = is_whole && PEM_write_bio_X509(all.get(), one.get()) == 1;
  }
  if (!is_whole) throw std::bad_alloc();
  char* text = nullptr;
  const long size = BIO_get_mem_data(all.get(), &text);
  return {text, static_cast<size_t>(size)};
}

// What of the files is used, as PEM.
struct TlsContents {
  std::string pair;         // key and chain, which belong together
  std::string authorities;  // empty: none
};

Result<TlsContents> ReadTlsFiles(const TlsFiles& files) {
  DRAPE_ASSIGN_OR_RETURN(const std::vector<Certificate> chain, ReadCertificates(files.certificate));
  DRAPE_ASSIGN_OR_RETURN(const Key key, ReadKey(files.key));
  if (X509_check_private_key(chain[0].get(), key.get()) != 1) {
    return TlsFileFailed(files.key, "is not the key of '" + files.certificate + "'");
  }
  TlsContents contents{.pair = Written(chain, key), .authorities = {}};
  if (files.client_authorities.empty()) return contents;
  DRAPE_ASSIGN_OR_RETURN(const std::vector<Certificate> authorities,
                         ReadCertificates(files.client_authorities));
  contents.authorities = Written(authorities);
  return contents;
}

}  // namespace

MemoryFile::~MemoryFile() {
  if (descriptor_ >= 0) close(descriptor_);
}

Status MemoryFile::Replace(const std::string& content) {
  if (content == content_) return Status::Ok();
  const int filled = memfd_create("draped", MFD_CLOEXEC);
  bool is_there = filled >= 0 && write(filled, content.data(), content.size()) ==
                                     static_cast<ssize_t>(content.size());
  if (is_there && descriptor_ < 0) {
    descriptor_ = filled;
  } else {
    is_there = is_there && dup3(filled, descriptor_, O_CLOEXEC) >= 0;
    if (filled >= 0) close(filled);
  }
  if (!is_there) {
    return {StatusCode::kResourceExhausted, "TLS_FILE_FAILED",
            "there is no memory, or no descriptor, for a copy"};
  }
  content_ = content;
  return Status::Ok();
}

std::string MemoryFile::path() const {
  return descriptor_ < 0 ? std::string() : "/proc/self/fd/" + std::to_string(descriptor_);
}

Result<std::shared_ptr<TlsInUse>> TlsInUse::Open(TlsFiles files) {
  const std::shared_ptr<TlsInUse> in_use(new TlsInUse(std::move(files)));
  DRAPE_RETURN_IF_ERROR(in_use->TakeFiles());
  return in_use;
}

TlsFiles TlsInUse::copies() const {
  return {pair_.path(), pair_.path(), authorities_.path()};
}

Status TlsInUse::TakeFiles() {
  DRAPE_ASSIGN_OR_RETURN(const TlsContents contents, ReadTlsFiles(files_));
  DRAPE_RETURN_IF_ERROR(pair_.Replace(contents.pair));
  return authorities_.Replace(contents.authorities);
}

std::optional<Status> TlsInUse::Look() {
  Status now = WithinMemory([this] { return TakeFiles(); });
  if (now.ok() == last_.ok() && now.message() == last_.message()) return std::nullopt;
  last_ = now;
  return now;
}

}  // namespace drape::api
