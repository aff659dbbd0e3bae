#include "server/api/sha256.h"

#include <openssl/evp.h>

#include <array>
#include <fstream>

#include "server/core/check.h"
#include "server/core/text.h"

namespace drape::api {
namespace {

constexpr size_t kBuildIdBytes = 16;

EVP_MD_CTX* Context(void* context) {
  return static_cast<EVP_MD_CTX*>(context);
}

std::string HashThisExecutable() {
  std::ifstream file("/proc/self/exe", std::ios::binary);
  Sha256 hash;
  std::array<char, 1 << 16> buffer;
  do {
    file.read(buffer.data(), buffer.size());
    hash.Add({buffer.data(), static_cast<size_t>(file.gcount())});
  } while (file);
  return HexOf(hash.Finish().substr(0, kBuildIdBytes));
}

}  // namespace

void Sha256::Free::operator()(void* context) const {
  EVP_MD_CTX_free(Context(context));
}

Sha256::Sha256() : context_(EVP_MD_CTX_new()) {
  const bool is_begun =
      context_ != nullptr && EVP_DigestInit_ex(Context(context_.get()), EVP_sha256(), nullptr) == 1;
  DRAPE_CHECK(is_begun, "OpenSSL has SHA-256");
}

void Sha256::Add(std::string_view bytes) {
  DRAPE_CHECK(EVP_DigestUpdate(Context(context_.get()), bytes.data(), bytes.size()) == 1,
              "SHA-256 of bytes in memory cannot fail");
}

std::string Sha256::Finish() {
  std::array<unsigned char, kBytes> hash;
  DRAPE_CHECK(EVP_DigestFinal_ex(Context(context_.get()), hash.data(), nullptr) == 1,
              "SHA-256 of bytes in memory cannot fail");
  return {reinterpret_cast<const char*>(hash.data()), hash.size()};
}

std::string Sha256Of(std::string_view bytes) {
  Sha256 hash;
  hash.Add(bytes);
  return hash.Finish();
}

const std::string& BuildId() {
  static const std::string id = HashThisExecutable();
  return id;
}

}  // namespace drape::api
