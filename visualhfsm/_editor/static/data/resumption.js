/**
 * Readmission after the editor was restarted on the same port: see visualhfsm/_editor/resumption.py.
 *
 * The key is never sent. The server must first prove that it has the key, too: in the meantime anybody on this machine
 * may have listened on the port.
 */

export class Resumption {
  /** @type {CryptoKey | undefined} */
  #key = undefined;

  /** @param {string | undefined} key in hexadecimal digits, from the server's greeting */
  static async of(key) {
    const made = new Resumption();
    // Browsers offer cryptography only to pages from loopback or https.
    if (key && crypto.subtle)
      made.#key = await crypto.subtle.importKey("raw", bytes(key), {name: "HMAC", hash: "SHA-256"}, false, [
        "sign",
        "verify",
      ]);
    return made;
  }

  /**
   * Get a new cookie.
   *
   * @returns {Promise<boolean | undefined>} whether that was possible; undefined if the server was lost meanwhile
   */
  async resume() {
    const key = this.#key;
    if (!key) return false;
    try {
      const nonce = digits(crypto.getRandomValues(new Uint8Array(32)));
      const {challenge, proof} = await (await fetch(`resume?nonce=${nonce}`)).json();
      const isOurs = await crypto.subtle.verify("HMAC", key, bytes(proof), text(`server:${nonce}:${challenge}`));
      if (!isOurs) return false;
      const answer = digits(new Uint8Array(await crypto.subtle.sign("HMAC", key, text(`page:${challenge}`))));
      return (await fetch(`resume?challenge=${challenge}&proof=${answer}`)).ok;
    } catch {
      return undefined; // it is offline again, or is not an editor
    }
  }
}

/** @param {string} digits hexadecimal */
const bytes = (digits) => Uint8Array.from(digits.match(/../g) ?? [], (pair) => Number.parseInt(pair, 16));
/** @param {Uint8Array} values */
const digits = (values) => [...values].map((each) => each.toString(16).padStart(2, "0")).join("");
/** @param {string} words */
const text = (words) => new TextEncoder().encode(words);
