#include "tests/support/certificates/certificates.h"

#include <cstdlib>
#include <filesystem>
#include <stdexcept>

namespace drape::test {
namespace {

constexpr const char* kNewKey = " -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes";

void Run(const std::string& command) {
  if (std::system((command + " 2>/dev/null").c_str()) != 0) {
    throw std::runtime_error("openssl is needed (./run test installs it): " + command);
  }
}

}  // namespace

CertificateFolder::CertificateFolder() {
  std::string pattern = std::filesystem::temp_directory_path() / "drape_certificates_XXXXXX";
  if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("cannot make " + pattern);
  path_ = pattern;
}

CertificateFolder::~CertificateFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

Certificate CertificateFolder::MakeAuthority(const std::string& name) const {
  const Certificate made{Path(name + ".pem"), Path(name + ".key")};
  Run(std::string(
          "openssl req -x509 -days 2 -subj /CN=drape -addext subjectAltName=DNS:drape.test") +
      kNewKey + " -keyout " + made.key + " -out " + made.certificate);
  return made;
}

Certificate CertificateFolder::Issue(const std::string& name, const std::string& common_name,
                                     const Certificate& authority) const {
  const Certificate made{Path(name + ".pem"), Path(name + ".key")};
  const std::string request = Path(name + ".csr");
  Run("openssl req -subj '/CN=" + common_name + "'" + kNewKey + " -keyout " + made.key + " -out " +
      request);
  Run("openssl x509 -req -days 2 -in " + request + " -CA " + authority.certificate + " -CAkey " +
      authority.key + " -CAcreateserial -out " + made.certificate);
  return made;
}

}  // namespace drape::test
