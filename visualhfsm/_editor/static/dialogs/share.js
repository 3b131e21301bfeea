/** The address for viewers: they see every change and run, and can change nothing. */

import {html} from "lit";

import {ask} from "../data/commands.js";
import {notify} from "../kit/notices.js";
import {copyText} from "../data/unsent.js";
import {t} from "../kit/texts.js";
import {showDialog} from "../kit/dialog.js";

/** Show the address, to copy it, or to withdraw it. */
export async function showShare() {
  const shared = await ask("share");
  if (!shared) return;
  const address = new URL(shared.address, location.href).href;
  const choice = await showDialog({
    title: t("Share to look on"),
    content: () => html`
      <p>
        ${t(
          "All who open this address see every change and run here, live, and can change nothing; only STOP works. It leads to this machine: others reach it through a tunnel or a proxy.",
        )}
      </p>
      <p><input class="mono shared-address" readonly autofocus aria-label=${t("Address")} .value=${address} /></p>
    `,
    footer: (/** @type {import("../kit/dialog.js").Close<string>} */ close) =>
      html`<button type="button" class="button" @click=${() => close("withdraw")}>${t("Withdraw it")}</button
        ><button type="button" class="button primary" @click=${() => close(void copyText(address))}>
          ${t("Copy")}
        </button>`,
  });
  if (choice === "withdraw" && (await ask("share", {shared: false})))
    notify(t("The address is withdrawn: nobody looks on any more."));
}
