// Certificates for tests of TLS, made by openssl in a folder that vanishes with them.
#pragma once

#include <string>

namespace drape::test {

// PEM files.
struct Certificate {
  std::string certificate;
  std::string key;
};

// Throws std::runtime_error where openssl is missing (./run test installs it).
class CertificateFolder {
 public:
  CertificateFolder();
  ~CertificateFolder();
  CertificateFolder(const CertificateFolder&) = delete;
  CertificateFolder& operator=(const CertificateFolder&) = delete;

  std::string Path(const std::string& name) const { return path_ + "/" + name; }
  // Its own authority, for a server called drape.test.
  Certificate MakeAuthority(const std::string& name) const;
  // Signed by `authority`, with this common name.
  Certificate Issue(const std::string& name, const std::string& common_name,
                    const Certificate& authority) const;

 private:
  std::string path_;
};

}  // namespace drape::test
