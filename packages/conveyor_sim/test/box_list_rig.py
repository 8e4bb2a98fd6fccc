"""What tests of box lists look at, and how they make workbooks."""

from openpyxl import Workbook


def sizes(found):
    return [entry.size_mm for entry in found.entries]


def notes(found):
    return ' | '.join(found.notes)


def workbook(path, sheets, merged=()):
    book = Workbook()
    book.remove(book.active)
    for title, rows in sheets.items():
        sheet = book.create_sheet(title)
        for row in rows:
            sheet.append(row)
        for cells in merged:
            sheet.merge_cells(cells)
    book.save(path)
    return path
