#include "server/api/tls_files.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>

namespace drape::api {
namespace {

Status ReadPem(const std::string& path, std::string& text) {
  std::error_code ignored;  // no file at all is no regular file either
  std::ifstream file;
  if (std::filesystem::is_regular_file(path, ignored)) file.open(path, std::ios::binary);
  text.assign(std::istreambuf_iterator<char>(file), {});
  if (file.is_open() && !file.bad() && !text.empty()) return Status::Ok();
  return Status(StatusCode::kFailedPrecondition, "TLS_FILE_FAILED",
                "'" + path + "' cannot be read or is empty");
}

}  // namespace

Status ReadTlsFiles(const std::string& cert_file, const std::string& key_file,
                    ServerOptions& options) {
  if (cert_file.empty() && key_file.empty()) return Status::Ok();
  DRAPE_RETURN_IF_ERROR(ReadPem(cert_file, options.tls_certificate_pem));
  return ReadPem(key_file, options.tls_key_pem);
}

}  // namespace drape::api
