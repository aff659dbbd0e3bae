#include "server/api/request_log.h"

#include <spdlog/fmt/fmt.h>

#include <chrono>
#include <string_view>
#include <utility>

#include "server/core/log.h"
#include "server/core/text.h"
#include "server/session/session_registry.h"

namespace drape::api {
namespace {

using std::chrono::steady_clock;

// What clients wrote may be of any length. Names are shortened before: a part of one gives too
// much.
constexpr size_t kMaxTextBytes = 64;

std::string Field(const char* key, const std::string& text) {
  if (text.empty()) return {};
  return fmt::format(" {}={}", key, LogText(Shortened(WithoutSessionNames(text), kMaxTextBytes)));
}

}  // namespace

struct RequestTag::Text {
  std::string line;
  steady_clock::time_point begin;
};

bool RequestTag::IsWanted() {
  return spdlog::should_log(spdlog::level::debug);
}

void RequestTag::Begin(const std::string& method, const std::string& tenant,
                       const std::string& session, const std::string& request_id) {
  constexpr std::string_view kSuffix = "Request";
  std::string_view name = method;
  if (name.ends_with(kSuffix)) name.remove_suffix(kSuffix.size());
  auto text = std::make_shared<Text>();
  text->line =
      fmt::format("request method={}{}{}{}", name, Field("tenant", tenant),
                  Field("session", ShortSessionName(session)), Field("request_id", request_id));
  text->begin = steady_clock::now();
  text_ = std::move(text);
}

void RequestTag::Log(const Status& status) const {
  if (text_ == nullptr) return;
  const std::chrono::duration<double, std::milli> took = steady_clock::now() - text_->begin;
  spdlog::debug("{} code={}{} ms={:.3f}", text_->line, StatusCodeName(status.code()),
                Field("reason", status.reason()), took.count());
}

}  // namespace drape::api
