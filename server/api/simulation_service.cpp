#include "server/api/simulation_service.h"

#include <utility>

namespace drape::api {

SimulationService::SimulationService(ServiceContext context)
    : context_(std::move(context)), start_us_(context_.clock.NowUs()) {}

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
