#include "server/api/tls_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <optional>

#include "tests/support/certificates/certificates.h"

namespace drape::api {
namespace {

Status Checked(const TlsFiles& files) {
  return TlsInUse::Open(files).status();
}

class TlsFilesTest : public testing::Test {
 protected:
  std::string File(const std::string& name, const std::string& text) const {
    std::ofstream(folder_.Path(name)) << text;
    return folder_.Path(name);
  }

  const test::CertificateFolder folder_;
  const test::Certificate own_ = folder_.MakeAuthority("own");
  const test::Certificate other_ = folder_.MakeAuthority("other");
};

TEST_F(TlsFilesTest, PairsAndAuthoritiesAreGood) {
  EXPECT_TRUE(Checked({.certificate = own_.certificate, .key = own_.key}).ok());
  EXPECT_TRUE(Checked({.certificate = own_.certificate,
                       .key = own_.key,
                       .client_authorities = other_.certificate})
                  .ok());
}

TEST_F(TlsFilesTest, WhatIsNoCertificateOrKeyIsNamed) {
  const std::string empty = File("empty.pem", ""), text = File("text.pem", "PEM");
  for (const std::string& bad :
       {empty, text, folder_.Path("missing.pem"), testing::TempDir(), std::string()}) {
    for (int which = 0; which < 3; ++which) {
      TlsFiles files{own_.certificate, own_.key, own_.certificate};
      if (which == 2 && bad.empty()) continue;  // no authorities are fine
      (which == 0 ? files.certificate : which == 1 ? files.key : files.client_authorities) = bad;
      const Status status = Checked(files);
      EXPECT_EQ(status.reason(), "TLS_FILE_FAILED") << which << " " << bad;
      EXPECT_THAT(status.message(), testing::HasSubstr("'" + bad + "'"));
    }
  }
}

TEST_F(TlsFilesTest, AKeyOfAnotherCertificateIsRefused) {
  const Status status = Checked({.certificate = own_.certificate, .key = other_.key});
  EXPECT_EQ(status.reason(), "TLS_FILE_FAILED");
  EXPECT_THAT(status.message(), testing::HasSubstr("is not the key of"));
}

// As where a certificate is renewed before its key.
TEST_F(TlsFilesTest, WhatIsInUseChangesToGoodPairsAloneAndTellsOnce) {
  const auto text = [](const std::string& path) {
    std::ifstream file(path);
    return std::string{std::istreambuf_iterator<char>(file), {}};
  };
  const auto copy = [](const std::string& from, const std::string& to) {
    std::filesystem::copy_file(from, to, std::filesystem::copy_options::overwrite_existing);
  };
  const TlsFiles files{folder_.Path("used.pem"), folder_.Path("used.key")};
  copy(own_.certificate, files.certificate);
  copy(own_.key, files.key);
  const auto in_use = TlsInUse::Open(files).value();
  const TlsFiles copies = in_use->copies();
  EXPECT_TRUE(Checked(copies).ok());
  EXPECT_THAT(text(copies.certificate), testing::HasSubstr(text(own_.certificate)));
  EXPECT_EQ(copies.client_authorities, "");
  EXPECT_FALSE(in_use->Look().has_value());
  copy(other_.certificate, files.certificate);
  const std::optional<Status> bad = in_use->Look();
  ASSERT_TRUE(bad.has_value());
  EXPECT_THAT(bad->message(), testing::HasSubstr("is not the key of"));
  EXPECT_FALSE(in_use->Look().has_value());
  EXPECT_THAT(text(copies.certificate), testing::HasSubstr(text(own_.certificate)));
  copy(other_.key, files.key);
  const std::optional<Status> good = in_use->Look();
  ASSERT_TRUE(good.has_value());
  EXPECT_TRUE(good->ok());
  EXPECT_EQ(in_use->copies().certificate, copies.certificate);
  EXPECT_TRUE(Checked(copies).ok());
  EXPECT_THAT(text(copies.certificate), testing::HasSubstr(text(other_.certificate)));
}

// As where a file is being written, or was damaged.
TEST_F(TlsFilesTest, AListWithACertificateThatCannotBeReadIsRefused) {
  std::ifstream good(own_.certificate), next(other_.certificate);
  const std::string first{std::istreambuf_iterator<char>(good), {}};
  const std::string second{std::istreambuf_iterator<char>(next), {}};
  std::string spoiled = second;
  spoiled[spoiled.size() / 2] = '!';
  for (const std::string& damaged :
       {second.substr(0, second.size() / 2), second.substr(0, second.size() - 5), spoiled}) {
    const std::string file = File("chain.pem", first + damaged);
    for (const TlsFiles& files :
         {TlsFiles{file, own_.key, ""}, TlsFiles{own_.certificate, own_.key, file}}) {
      const Status status = Checked(files);
      EXPECT_EQ(status.reason(), "TLS_FILE_FAILED");
      EXPECT_THAT(status.message(), testing::HasSubstr("cannot be read"));
    }
  }
  EXPECT_TRUE(Checked({File("chain.pem", first + second + "\nnothing\n"), own_.key}).ok());
}

TEST_F(TlsFilesTest, AChainIsUsedWhole) {
  const auto text = [](const std::string& path) {
    std::ifstream file(path);
    return std::string{std::istreambuf_iterator<char>(file), {}};
  };
  const std::string chain = text(own_.certificate) + text(other_.certificate);
  const auto in_use =
      TlsInUse::Open({File("chain.pem", chain), own_.key, own_.certificate}).value();
  EXPECT_THAT(text(in_use->copies().certificate), testing::HasSubstr(chain));
  EXPECT_EQ(text(in_use->copies().client_authorities), text(own_.certificate));
}

TEST_F(TlsFilesTest, WhoReadsAFileInMemoryGetsAWholeContent) {
  MemoryFile file;
  ASSERT_TRUE(file.Replace(std::string(100'000, 'a')).ok());
  std::ifstream before(file.path());
  ASSERT_TRUE(file.Replace("b").ok());
  std::ifstream after(file.path());
  EXPECT_EQ((std::string{std::istreambuf_iterator<char>(before), {}}), std::string(100'000, 'a'));
  EXPECT_EQ((std::string{std::istreambuf_iterator<char>(after), {}}), "b");
}

}  // namespace
}  // namespace drape::api
