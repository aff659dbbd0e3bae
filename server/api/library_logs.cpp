#include "server/api/library_logs.h"

#include <google/protobuf/stubs/logging.h>
#include <grpc/support/log.h>

#include <cstring>

#include "server/core/log.h"

namespace drape::api {

void TakeLibraryLogs() {
  gpr_set_log_function([](gpr_log_func_args* args) {
    const char* slash = std::strrchr(args->file, '/');
    spdlog::debug("grpc file={}:{} message=\"{}\"", slash ? slash + 1 : args->file, args->line,
                  args->message);
  });
  google::protobuf::SetLogHandler(
      [](google::protobuf::LogLevel level, const char*, int, const std::string& message) {
        if (level == google::protobuf::LOGLEVEL_FATAL) spdlog::critical("protobuf {}", message);
        spdlog::debug("protobuf message=\"{}\"", message);
      });
}

}  // namespace drape::api
