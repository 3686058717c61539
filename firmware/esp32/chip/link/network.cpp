#include "link/network.hpp"

#include <array>
#include <atomic>
#include <cstring>

#include "esp_event.h"
#include "esp_netif.h"
#include "esp_random.h"
#include "esp_wifi.h"
#include "lwip/sockets.h"
#include "mbedtls/md.h"

namespace chladni::chip {

namespace {

// A flood must not keep the main loop from its touches.
constexpr uint32_t kMostPerTurn = 8;

int udp_socket = -1;
sockaddr_in peer{};
mbedtls_md_context_t hmac_context;
bool has_hmac = false;
// Written by the event task, read by the main loop.
std::atomic<uint32_t> address{0};

void on_event(void*, esp_event_base_t base, int32_t event, void* data) {
  if (base == IP_EVENT && event == IP_EVENT_STA_GOT_IP) {
    address = static_cast<const ip_event_got_ip_t*>(data)->ip_info.ip.addr;
  } else if (base == WIFI_EVENT && event == WIFI_EVENT_STA_START) {
    esp_wifi_connect();
  } else if (base == WIFI_EVENT && event == WIFI_EVENT_STA_DISCONNECTED) {
    address = 0;
    // Forever: a device is to come back when its network does. An attempt scans for a second or
    // more, so this is no busy loop.
    esp_wifi_connect();
  }
}

esp_err_t start_radio(const Network& network) {
  esp_err_t status = esp_netif_init();
  if (status == ESP_OK) status = esp_event_loop_create_default();
  if (status != ESP_OK) return status;
  if (esp_netif_create_default_wifi_sta() == nullptr) return ESP_ERR_NO_MEM;
  wifi_init_config_t init = WIFI_INIT_CONFIG_DEFAULT();
  // What it would keep there lies in the network record.
  init.nvs_enable = 0;
  status = esp_wifi_init(&init);
  if (status == ESP_OK) status = esp_wifi_set_storage(WIFI_STORAGE_RAM);
  if (status == ESP_OK) {
    status = esp_event_handler_instance_register(WIFI_EVENT, ESP_EVENT_ANY_ID, on_event, nullptr,
                                                 nullptr);
  }
  if (status == ESP_OK) {
    status = esp_event_handler_instance_register(IP_EVENT, IP_EVENT_STA_GOT_IP, on_event, nullptr,
                                                 nullptr);
  }
  if (status == ESP_OK) status = esp_wifi_set_mode(WIFI_MODE_STA);
  if (status != ESP_OK) return status;
  wifi_config_t config{};
  static_assert(sizeof(config.sta.ssid) == network_format::kSsidBytes, "the record's field");
  static_assert(sizeof(config.sta.password) == network_format::kPassphraseBytes, "as above");
  std::memcpy(config.sta.ssid, network.ssid.data(), sizeof(config.sta.ssid));
  std::memcpy(config.sta.password, network.passphrase.data(), sizeof(config.sta.password));
  const bool is_open = network.passphrase[0] == '\0';
  config.sta.threshold.authmode = is_open ? WIFI_AUTH_OPEN : WIFI_AUTH_WPA2_PSK;
  status = esp_wifi_set_config(WIFI_IF_STA, &config);
  // Sleeping between beacons would cost a tenth of a second.
  if (status == ESP_OK) status = esp_wifi_start();
  if (status == ESP_OK) status = esp_wifi_set_ps(WIFI_PS_NONE);
  return status;
}

}  // namespace

esp_err_t network_start(const Network& network) {
  esp_err_t status = start_radio(network);
  if (status != ESP_OK) return status;
  mbedtls_md_init(&hmac_context);
  const mbedtls_md_info_t* const sha256 = mbedtls_md_info_from_type(MBEDTLS_MD_SHA256);
  has_hmac = sha256 != nullptr && mbedtls_md_setup(&hmac_context, sha256, 1) == 0;
  if (!has_hmac) return ESP_FAIL;
  udp_socket = socket(AF_INET, SOCK_DGRAM, IPPROTO_UDP);
  if (udp_socket < 0) return ESP_ERR_NO_MEM;
  sockaddr_in own{};
  own.sin_family = AF_INET;
  own.sin_port = htons(network.port);
  own.sin_addr.s_addr = htonl(INADDR_ANY);
  if (bind(udp_socket, reinterpret_cast<const sockaddr*>(&own), sizeof(own)) != 0) return ESP_FAIL;
  return ESP_OK;
}

void network_poll(Datagrams& datagrams) {
  datagrams.set_address(address);
  if (udp_socket < 0) return;
  datagrams.poll();
  // One byte more than any may have, so that a longer one shows. Not on the main task's stack.
  static std::array<uint8_t, network_format::kMaxDatagram + 1> bytes;
  for (uint32_t k = 0; k < kMostPerTurn; ++k) {
    socklen_t size = sizeof(peer);
    const int count = recvfrom(udp_socket, bytes.data(), bytes.size(), MSG_DONTWAIT,
                               reinterpret_cast<sockaddr*>(&peer), &size);
    if (count < 0) return;
    datagrams.receive(bytes.data(), static_cast<uint32_t>(count), peer.sin_addr.s_addr);
  }
}

void network_send(const uint8_t* bytes, uint32_t count) {
  // What does not get out is lost like anything else, and asked for again.
  sendto(udp_socket, bytes, count, MSG_DONTWAIT, reinterpret_cast<const sockaddr*>(&peer),
         sizeof(peer));
}

bool network_hmac(const uint8_t* key, const uint8_t* bytes, uint32_t count, uint8_t* mac) {
  return has_hmac && mbedtls_md_hmac_starts(&hmac_context, key, network_format::kKeyBytes) == 0 &&
         mbedtls_md_hmac_update(&hmac_context, bytes, count) == 0 &&
         mbedtls_md_hmac_finish(&hmac_context, mac) == 0;
}

uint32_t network_random() { return esp_random(); }

}  // namespace chladni::chip
