#include "server/api/token_file.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <sstream>

#include "server/api/sha256.h"

namespace drape::api {
namespace {

constexpr size_t kMaxTenantBytes = 64;
constexpr char kOperator[] = "@operator";

int DigitOf(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

// Empty: not a hash.
std::string ParseHash(const std::string& digits) {
  std::string bytes;
  if (digits.size() != 2 * Sha256::kBytes) return bytes;
  for (size_t k = 0; k < digits.size(); k += 2) {
    const int high = DigitOf(digits[k]), low = DigitOf(digits[k + 1]);
    if (high < 0 || low < 0) return {};
    bytes += static_cast<char>(16 * high + low);
  }
  return bytes;
}

constexpr std::string_view kRate = "particle_substeps_per_s=", kBuilderRate = "builder_s_per_s=",
                           kWeight = "weight=";
constexpr uint32_t kMaxWeight = 100;

bool IsRate(const std::optional<double>& rate) {
  return rate && *rate >= 0 && std::isfinite(*rate);
}

// The number of `NAMENUMBER`; none: it is not that.
template <class Number>
std::optional<Number> ParseNumber(std::string_view name, const std::string& word) {
  if (!word.starts_with(name)) return std::nullopt;
  Number number{};
  const char* const end = word.data() + word.size();
  const auto [rest, error] = std::from_chars(word.data() + name.size(), end, number);
  if (error != std::errc() || rest != end) return std::nullopt;
  return number;
}

Status Failed(const std::string& path, const std::string& why) {
  return {StatusCode::kFailedPrecondition, "TOKEN_FILE_FAILED", "'" + path + "' " + why};
}

}  // namespace

bool IsTenantName(const std::string& name) {
  return !name.empty() && name.size() <= kMaxTenantBytes &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) {
           return std::isalnum(c) != 0 || c == '.' || c == '_' || c == '-';
         });
}

Result<TokenFile> TokenFile::Read(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file.is_open() || file.bad()) return Failed(path, "cannot be read");
  return Parse(text, path);
}

Result<TokenFile> TokenFile::Parse(const std::string& text, const std::string& path) {
  TokenFile tokens;
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    std::istringstream words(line.substr(0, line.find('#')));
    std::string tenant, digits, rest;
    if (!(words >> tenant)) continue;
    const auto wrong = [&](const std::string& why) {
      return Failed(path, "line " + std::to_string(number) + ": " + why);
    };
    const bool is_operator = tenant == kOperator;
    if (!is_operator && !IsTenantName(tenant)) {
      return wrong(
          "the tenant's name must be 1 to 64 letters, digits, '.', '_' or '-', or @operator");
    }
    words >> digits;
    const std::string hash = ParseHash(digits);
    if (hash.empty()) {
      return wrong("after the tenant's name come the 64 hexadecimal digits of a SHA-256");
    }
    while (words >> rest) {
      if (is_operator) return wrong("@operator has nothing but hashes");
      if (const std::string why = tokens.Take(tenant, rest); !why.empty()) return wrong(why);
    }
    if (tokens.tenants_.contains(hash) || tokens.operators_.contains(hash)) {
      return wrong("this hash occurs twice");
    }
    if (is_operator) {
      tokens.operators_.insert(hash);
    } else {
      tokens.tenants_.emplace(hash, tenant);
    }
  }
  if (tokens.tenants_.empty()) return Failed(path, "has no token of a tenant");
  return tokens;
}

std::string TokenFile::Take(const std::string& tenant, const std::string& word) {
  const auto has_same = [&](auto& values, auto value) {
    return values.emplace(tenant, value).first->second == value;
  };
  const auto rate = ParseNumber<double>(kRate, word);
  const auto builder_rate = ParseNumber<double>(kBuilderRate, word);
  const auto weight = ParseNumber<uint32_t>(kWeight, word);
  bool is_same = true;
  if (IsRate(rate)) {
    is_same = has_same(rates_, *rate);
  } else if (IsRate(builder_rate)) {
    is_same = has_same(builder_rates_, *builder_rate);
  } else if (weight && *weight >= 1 && *weight <= kMaxWeight) {
    is_same = has_same(weights_, *weight);
  } else {
    return "after the hash may come particle_substeps_per_s=NUMBER and builder_s_per_s=NUMBER (0 "
           "or more) and weight=NUMBER (1 to 100), not '" +
           word + "'";
  }
  if (is_same) return {};
  return "the tenant has another " + word.substr(0, word.find('=')) + " already";
}

bool TokenFile::IsOperator(std::string_view token) const {
  return operators_.contains(Sha256Of(token));
}

std::set<std::string> TokenFile::tenants() const {
  std::set<std::string> names;
  for (const auto& [hash, tenant] : tenants_) names.insert(tenant);
  return names;
}

std::string TokenFile::HashOf(std::string_view token) {
  return Sha256Of(token);
}

std::optional<std::string> TokenFile::TenantOfHash(const std::string& hash) const {
  const auto found = tenants_.find(hash);
  if (found == tenants_.end()) return std::nullopt;
  return found->second;
}

}  // namespace drape::api
