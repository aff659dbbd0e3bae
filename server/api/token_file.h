// The tenants of a server and the hashes of their tokens.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>

#include "server/core/status.h"

namespace drape::api {

// 1 to 64 of a-z, A-Z, 0-9, '.', '_', '-'.
bool IsTenantName(const std::string& name);

// One line per token: a tenant's name, a space, and the SHA-256 of the token in hexadecimal digits
// (`printf %s TOKEN | sha256sum`); then, if the tenant has a rate of its own,
// `particle_substeps_per_s=NUMBER` or `builder_s_per_s=NUMBER` (0: no limit), and if it has another
// share of a full device than others, `weight=NUMBER` (1 to 100; without it 1). A tenant may have
// several tokens, so that they can be changed one after the other; what is said of it with several
// of them must be the same. The name `@operator` stands for those who look after the server
// (AdminService). '#' begins a comment. Immutable.
class TokenFile {
 public:
  // FAILED_PRECONDITION (TOKEN_FILE_FAILED) names the file and the line.
  static Result<TokenFile> Read(const std::string& path);
  static Result<TokenFile> Parse(const std::string& text, const std::string& path);

  // Tokens are found by their hashes, so the time tells nothing about them.
  static std::string HashOf(std::string_view token);
  // None: nobody's token.
  std::optional<std::string> TenantOfHash(const std::string& hash) const;
  std::optional<std::string> TenantOf(std::string_view token) const {
    return TenantOfHash(HashOf(token));
  }
  bool IsOperator(std::string_view token) const;
  size_t token_count() const { return tenants_.size(); }
  std::set<std::string> tenants() const;
  // Of the tenants that have one of their own [particle-substeps/s].
  const std::unordered_map<std::string, double>& rates() const { return rates_; }
  // Likewise of builder threads [s/s].
  const std::unordered_map<std::string, double>& builder_rates() const { return builder_rates_; }
  // Of the tenants that have one.
  const std::unordered_map<std::string, uint32_t>& weights() const { return weights_; }

 private:
  // One of the words behind a tenant's hash. What is wrong with it; empty: nothing.
  std::string Take(const std::string& tenant, const std::string& word);

  std::unordered_map<std::string, std::string> tenants_;  // by the bytes of the hash
  std::unordered_map<std::string, double> rates_;
  std::unordered_map<std::string, double> builder_rates_;
  std::unordered_map<std::string, uint32_t> weights_;
  std::set<std::string> operators_;  // the hashes of their tokens
};

}  // namespace drape::api
