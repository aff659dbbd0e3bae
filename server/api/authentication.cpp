#include "server/api/authentication.h"

#include <google/rpc/error_details.pb.h>
#include <google/rpc/status.pb.h>
#include <grpc/grpc_security_constants.h>

#include <chrono>
#include <string_view>
#include <utility>
#include <vector>

#include "server/api/status_mapping.h"

namespace drape::api {
namespace {

constexpr std::string_view kScheme = "Bearer ";

// None: the call carries no token, or several, which would be ambiguous.
std::optional<std::string_view> TokenOf(const grpc::CallbackServerContext& context) {
  const auto& metadata = context.client_metadata();
  if (metadata.count("authorization") != 1) return std::nullopt;
  const grpc::string_ref given = metadata.find("authorization")->second;
  const std::string_view value(given.data(), given.size());
  if (!value.starts_with(kScheme)) return std::nullopt;
  return value.substr(kScheme.size());
}

grpc::Status Refusal(grpc::StatusCode code, const char* reason, const char* message) {
  google::rpc::Status details;
  details.set_code(code);
  details.set_message(message);
  google::rpc::ErrorInfo error_info;
  error_info.set_reason(reason);
  error_info.set_domain(kErrorDomain);
  details.add_details()->PackFrom(error_info);
  return {code, message, details.SerializeAsString()};
}

Caller OwnerOfCertificate(const grpc::AuthContext& peer) {
  const std::vector<grpc::string_ref> names = peer.FindPropertyValues(GRPC_X509_CN_PROPERTY_NAME);
  if (!peer.IsPeerAuthenticated() || names.size() != 1) return {.is_refused = true};
  std::string tenant(names[0].data(), names[0].size());
  if (!IsTenantName(tenant)) return {.is_refused = true};
  return {.tenant = std::move(tenant)};
}

}  // namespace

int64_t DeadlineOf_us(const grpc::CallbackServerContext& context, const Clock& clock) {
  using std::chrono::system_clock;
  constexpr int64_t kNever_us = std::numeric_limits<int64_t>::max();
  const system_clock::time_point deadline = context.deadline();
  if (deadline == system_clock::time_point::max()) return kNever_us;
  const auto left = deadline - system_clock::now();
  return clock.NowUs() + std::chrono::duration_cast<std::chrono::microseconds>(left).count();
}

Authentication::Authentication(TokenFile tokens)
    : tokens_(std::make_shared<const TokenFile>(std::move(tokens))) {}

void Authentication::Replace(TokenFile tokens) {
  auto replaced = std::make_shared<const TokenFile>(std::move(tokens));
  const std::lock_guard lock(mutex_);
  tokens_ = std::move(replaced);
}

std::shared_ptr<Authentication> Authentication::ByCertificate() {
  auto made = std::make_shared<Authentication>();
  made->by_certificate_ = true;
  return made;
}

std::shared_ptr<const TokenFile> Authentication::tokens() const {
  const std::lock_guard lock(mutex_);
  return tokens_;
}

bool Authentication::has_tokens() const {
  return tokens() != nullptr;
}

bool Authentication::IsOperator(const grpc::CallbackServerContext& context) const {
  const std::shared_ptr<const TokenFile> tokens = this->tokens();
  const std::optional<std::string_view> token = TokenOf(context);
  return tokens != nullptr && token.has_value() && tokens->IsOperator(*token);
}

std::set<std::string> Authentication::tenants() const {
  const std::shared_ptr<const TokenFile> tokens = this->tokens();
  return tokens == nullptr ? std::set<std::string>() : tokens->tenants();
}

std::unordered_map<std::string, double> Authentication::rates() const {
  const std::shared_ptr<const TokenFile> tokens = this->tokens();
  return tokens == nullptr ? std::unordered_map<std::string, double>() : tokens->rates();
}

std::unordered_map<std::string, double> Authentication::builder_rates() const {
  const std::shared_ptr<const TokenFile> tokens = this->tokens();
  return tokens == nullptr ? std::unordered_map<std::string, double>() : tokens->builder_rates();
}

std::unordered_map<std::string, uint32_t> Authentication::weights() const {
  const std::shared_ptr<const TokenFile> tokens = this->tokens();
  return tokens == nullptr ? std::unordered_map<std::string, uint32_t>() : tokens->weights();
}

Caller Authentication::Identify(const grpc::CallbackServerContext& context) const {
  if (by_certificate_) return OwnerOfCertificate(*context.auth_context());
  const std::shared_ptr<const TokenFile> tokens = this->tokens();
  if (tokens == nullptr) return {};
  const std::optional<std::string_view> token = TokenOf(context);
  if (!token) return {.is_refused = true};
  std::string hash = TokenFile::HashOf(*token);
  std::optional<std::string> tenant = tokens->TenantOfHash(hash);
  if (!tenant) return {.is_refused = true};
  return {.tenant = *std::move(tenant), .token_hash = std::move(hash)};
}

bool Authentication::IsValid(const Caller& caller) const {
  const std::shared_ptr<const TokenFile> tokens = this->tokens();
  return tokens == nullptr || tokens->TenantOfHash(caller.token_hash) == caller.tenant;
}

Status TokenTakenAway() {
  return {StatusCode::kFailedPrecondition, kInvalidToken,
          "the token with which the call began is not valid any longer"};
}

grpc::Status Unauthenticated() {
  return Refusal(grpc::StatusCode::UNAUTHENTICATED, kInvalidToken,
                 "the call carries no valid token of a tenant (authorization: Bearer TOKEN; one of "
                 "@operator is for drape.v1.AdminService alone), or its connection no certificate "
                 "of a tenant");
}

grpc::Status AdminOnly() {
  return Refusal(grpc::StatusCode::PERMISSION_DENIED, "ADMIN_ONLY",
                 "this is for operators of the server: by --admin-listen, or with a token of "
                 "@operator");
}

}  // namespace drape::api
