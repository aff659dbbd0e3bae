#include "server/api/simulation_service.h"

#include <utility>

namespace drape::api {

namespace {

// Until a client has read some of its answers [ms].
constexpr int64_t kRetryWhenUnread_ms = 200;

ServiceContext WithBudget(ServiceContext context) {
  if (context.unread != nullptr) return context;
  const RequestLimits& limits = context.limits;
  context.unread = std::make_shared<ByteBudget>(
      "TOO_MANY_UNREAD_BYTES",
      ByteBudget::Limit{"max_unread_bytes_per_session", limits.max_unread_bytes_per_session},
      ByteBudget::Limit{"max_unread_bytes", limits.max_unread_bytes}, kRetryWhenUnread_ms);
  return context;
}

}  // namespace

SimulationService::SimulationService(ServiceContext context)
    : context_(WithBudget(std::move(context))), start_us_(context_.clock.NowUs()) {}

uint64_t Fingerprint(const google::protobuf::Message& request) {
  uint64_t hash = 0xcbf29ce484222325u;
  const auto add = [&hash](const std::string& bytes) {
    for (const char byte : bytes) hash = (hash ^ static_cast<unsigned char>(byte)) * 0x100000001b3u;
  };
  add(request.GetTypeName());
  add(request.SerializeAsString());
  return hash;
}

}  // namespace drape::api
