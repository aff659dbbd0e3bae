// SHA-256, by OpenSSL.
#pragma once

#include <memory>
#include <string>
#include <string_view>

namespace drape::api {

// Of bytes that come piece by piece. Not thread-safe.
class Sha256 {
 public:
  static constexpr size_t kBytes = 32;

  Sha256();
  void Add(std::string_view bytes);
  // kBytes of it. Nothing can be added then.
  std::string Finish();

 private:
  struct Free {
    void operator()(void* context) const;
  };
  std::unique_ptr<void, Free> context_;
};

std::string Sha256Of(std::string_view bytes);

// What tells builds of this executable apart: the hash of its file, in 32 hexadecimal digits.
const std::string& BuildId();

}  // namespace drape::api
