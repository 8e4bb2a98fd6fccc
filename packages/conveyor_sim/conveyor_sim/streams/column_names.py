"""What the columns of people's box lists are called, in many languages.

A header is taken apart into words; a unit among them is set aside, and what is left is looked up,
first as it is and then without words such as `outer` or `item`.
"""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass, replace

from conveyor_sim.streams.units import LENGTH, LOAD, WEIGHT, unit_of

#: Kind of unit of each meaning that has one.
KINDS = {
    'length': LENGTH,
    'width': LENGTH,
    'height': LENGTH,
    'depth': LENGTH,
    'size': LENGTH,
    'weight': WEIGHT,
    'max_top_load': LOAD,
}

#: Names of each meaning, with commas between them; of two columns for one text the name that
#: comes first has it.
_SYNONYMS = {
    'length': (
        'length, lengths, l, long, len, dx, x, Länge, Laenge, longueur, largo, longitud, '
        'lunghezza, comprimento, lengte, długość, délka, längd, længde, laengde, lengde, pituus, '
        'uzunluk, длина, 长, 长度, 長さ, 길이'
    ),
    'width': (
        'width, widths, w, b, breadth, wide, dy, y, Breite, largeur, ancho, anchura, larghezza, '
        'largura, breedte, szerokość, šířka, bredd, bredde, leveys, genişlik, ширина, 宽, 宽度, '
        '幅, 너비, 폭'
    ),
    'height': (
        'height, heights, h, high, hgt, dz, z, Höhe, Hoehe, hauteur, alto, altura, altezza, '
        'hoogte, wysokość, výška, höjd, højde, hoyde, høyde, korkeus, yükseklik, высота, 高, 高度, '
        '高さ, 높이'
    ),
    'depth': (
        'depth, depths, d, t, deep, Tiefe, profondeur, profundidad, fondo, profondità, '
        'profundidade, diepte, głębokość, hloubka, djup, dybde, syvyys, derinlik, глубина, 深'
    ),
    'size': (
        'size, sizes, dimension, dimensions, dims, dim, measurements, l x w x h, l x b x h, '
        'lxwxh, lxbxh, lx wx h, lx bx h, w x d x h, wx dx h, Abmessung, Abmessungen, Maße, '
        'Außenmaße, Größe, Groesse, dimensiones, dimensioni, dimensões, afmetingen, wymiary, '
        'rozměry, размеры, габариты, 尺寸'
    ),
    'weight': (
        'weight, weights, wt, mass, Gewicht, Masse, poids, peso, waga, masa, hmotnost, vikt, vægt, '
        'vaegt, vekt, paino, ağırlık, вес, масса, 重量, 重さ, 質量, 무게, Bruttogewicht, '
        'Stückgewicht, Einzelgewicht, Kartongewicht, Paketgewicht, Versandgewicht, net weight, '
        'Nettogewicht, Gewicht netto, poids net, peso neto, peso netto'
    ),
    'quantity': (
        'quantity, quantities, qty, count, copies, pieces, pcs, pc, number of boxes, no of boxes, '
        'Menge, Anzahl, Stück, Stueck, Stk, Stückzahl, Stueckzahl, quantité, qté, cantidad, cant, '
        'quantità, qta, quantidade, qtd, aantal, ilość, szt, množství, počet, antal, määrä, adet, '
        'miktar, количество, кол во, 数量, 個数, 수량, order qty, ordered qty, qty ordered, '
        'order quantity, quantity ordered, ordered quantity, Bestellmenge, Auftragsmenge, '
        'Liefermenge, boxes, cartons, cases, packages, parcels, pkgs, box count, '
        'carton count, case count, package count, parcel count, num boxes, num pkgs, num cartons, '
        'number of cartons, number of cases, number of packages, number of parcels, '
        'number of pieces, no of cartons, no of cases, no of packages, no of parcels, '
        'no of pieces, Kartons, Pakete, Packstücke, Kolli, Colli, Anzahl Kartons, Anzahl Pakete, '
        'Anzahl Packstücke, Anzahl Kolli, nombre de colis, nb colis, bultos'
    ),
    'id': (
        'id, box id, boxid, box no, box number, box, carton id, cartonid, carton no, carton, '
        'case id, package id, parcel id, Packstück, Packstueck, Karton, Karton Nr, Kiste, caja, '
        'colis, lpn, sscc, barcode, tracking number, label'
    ),
    'sku': (
        'sku, skus, article id, articleid, article no, article number, Artikelnr, Artikel Nr, '
        'Artikelnummer, item id, itemid, item no, item number, product id, productid, '
        'product code, part no, part number, ean, gtin, upc, asin, reference, ref, référence, '
        'referencia, riferimento, indeks, артикул, 货号, article, Artikel, item, code, código, '
        'codice, kód, kod, Bestellcode, ürün, ürün kodu, 商品コード, 品番, 상품코드, nr, no, '
        'number, Nummer, numer, número, numero, numéro, číslo, номер, 编号, 番号, 번호'
    ),
    'order': (
        'order id, orderid, order, orders, order no, order nr, order number, Auftrag, Auftragsnr, '
        'Auftrag Nr, Auftragsnummer, Bestellung, Bestellnr, Bestell Nr, Bestellnummer, commande, '
        'pedido, ordine, zamówienie, objednávka, bestelling, заказ, 订单, delivery, delivery no, '
        'Lieferung, shipment, shipment id, consignment'
    ),
    'sequence': 'sequence, seq',
    'source': 'source',
    'fragile': (
        'fragile, is fragile, fragil, frágil, zerbrechlich, delicate, breakable, kruche, křehké, '
        'breekbaar, ömtålig, bräcklig, skrøbelig, särkyvä, kırılgan, хрупкий, хрупкое, '
        '易碎, 割れ物, 壊れ物'
    ),
    'upright': (
        'this side up, thissideup, this way up, side up, upright, keep upright, upright only, '
        'no tilt, do not tilt, nicht kippen, aufrecht, oben'
    ),
    'tiltable': 'tiltable, may be tilted, can be tilted, kippbar',
    'stackable': (
        'stackable, is stackable, can be stacked, stacking allowed, stapelbar, gerbable, '
        'empilable, apilable, impilabile, empilhável, stapelbaar'
    ),
    'unstackable': (
        'do not stack, non stackable, not stackable, unstackable, no stacking, nothing on top, '
        'no load on top, nicht stapelbar, non gerbable, no apilable, non impilabile, '
        'niet stapelbaar'
    ),
    'max_top_load': (
        'max top load, max load on top, top load, load on top, max stack load, max stack weight, '
        'max weight on top, max top weight, max weight above, '
        'maximum weight above, max stacking weight, Auflast, max Auflast, Stapellast'
    ),
    'allowed_up': 'allowed up',
    'destination': (
        'destination, destinations, dest, Ziel, Zielort, destino, destinazione, bestemming, '
        'назначение'
    ),
    'target': 'target',
}

#: Words that say no more than that the column is about a box.
_QUALIFIERS = frozenset(
    ('outer', 'outside', 'external', 'overall', 'gross', 'unit', 'single', 'each', 'per', 'box',
     'carton', 'case', 'package', 'packaging', 'pack', 'parcel', 'item', 'product', 'article',
     'shipping', 'master', 'the', 'of', 'auszen', 'aussen', 'brutto', 'einzel', 'karton', 'paket',
     'artikel', 'stueck', 'stuck', 'verpackung', 'exterieur', 'externe', 'brut', 'unitaire',
     'colis', 'exterior', 'bruto', 'unitario', 'caja', 'dimensions', 'dimension', 'dims', 'size',
     'sizes', 'dim', 'measured', 'actual', 'edge')
)  # fmt: skip
#: Words of what holds pieces: a number of pieces in one box is no number of boxes.
_HOLDERS = frozenset(
    ('per', 'pro', 'par', 'por', 'je', 'box', 'carton', 'case', 'package', 'pack', 'parcel',
     'master', 'karton', 'paket', 'colis', 'caja', 'packaging', 'verpackung')
)  # fmt: skip
_FILLERS = frozenset(('in', 'im', 'en', 'a'))
_LETTERS = str.maketrans({'ł': 'l', 'ø': 'o', 'æ': 'ae', 'ß': 'sz', 'đ': 'd', 'ı': 'i', 'œ': 'oe'})


def words_of(header: str) -> list[str]:
    """The words of a header, in small letters without accents."""
    apart = re.sub(r'(?<=[a-z])(?=[A-Z])', ' ', header)
    plain = unicodedata.normalize('NFKD', apart.lower().translate(_LETTERS)).casefold()
    plain = ''.join(letter for letter in plain if not unicodedata.combining(letter))
    return re.findall(r'[^\W_]+|["″]', plain)


#: Each name of a column: its meaning, and how early it comes among the names of that meaning.
_NAMES: dict[str, tuple[str, int]] = {}
for _meaning, _text in _SYNONYMS.items():
    for _rank, _name in enumerate(_text.split(', ')):
        _NAMES.setdefault(' '.join(words_of(_name)), (_meaning, _rank))


@dataclass(frozen=True)
class NamedColumn:
    """What a header says: a meaning, a unit, and how much it says so; empty where it does not.

    ``rank`` is less the better a name is; one with words that had to be left out comes later, and a
    net weight last.
    """

    meaning: str = ''
    unit: str = ''
    rank: int = 0

    @property
    def grade(self) -> int:
        """How good the name is, from 0: two columns of one grade may both be meant."""
        return self.rank // _LATE


_LATE = 1000


def read_header(header: str) -> NamedColumn:
    """What a column called ``header`` means, and its unit."""
    words = words_of(header)
    unit = unit_of(words[0], WEIGHT) if len(words) == 1 and len(words[0]) > 1 else ''
    if unit:
        return NamedColumn('weight', unit, _LATE)
    found = _looked_up(words)
    if found.meaning:
        return found
    for place in range(len(words) - 1, 0, -1):
        rest = words[:place] + words[place + 1 :]
        found = _looked_up([word for word in rest if word not in _FILLERS] or rest)
        unit = unit_of(words[place], KINDS.get(found.meaning, ''))
        if unit:
            return replace(found, unit=unit)
    return NamedColumn()


def _looked_up(words: list[str]) -> NamedColumn:
    known = _NAMES.get(' '.join(words))
    if known:
        net = known[0] == 'weight' and is_net(' '.join(words))
        return NamedColumn(known[0], '', known[1] + (2 * _LATE if net else 0))
    rest = ' '.join(word for word in words if word not in _QUALIFIERS)
    known = _NAMES.get(rest)
    if known and known[0] == 'quantity' and not _HOLDERS.isdisjoint(words):
        return NamedColumn()
    return NamedColumn(known[0], '', known[1] + _LATE) if known else NamedColumn()


def is_net(header: str) -> bool:
    """Whether a header says that what the box itself weighs is left out."""
    return any(re.match('net$|neto|netto', word) for word in words_of(header))


def hints_at(header: str, meaning: str) -> bool:
    """Whether a word of a header is a name of ``meaning``, though the whole header is not."""
    return any(
        (len(word) > 2 and _NAMES.get(word, ('', 0))[0] == meaning)
        or (meaning == 'weight' and word.endswith(('gewicht', 'weight')))
        for word in words_of(header)
    )


#: Every meaning that a column can have.
MEANINGS = tuple(_SYNONYMS)
